#include "sim/plan.h"

#include <math.h>

#include "sim/base/parallel.h"
#include "sim/step/choose.h"

typedef struct Cost {
    double step, seconds, megabytes;
} Cost;

static Cost estimate(const Sim *sim) {
    const System *system = &sim->system;
    const SolverDef *solver = &sim->scene->solver;
    double duration = (sim->scene->film.frame_count - 1) / sim->scene->film.rate;
    bool implicit = sim->stepper->implicit;
    Cost cost = {.megabytes = 2.0 + 1e-6 * (double)sim->arena.bytes_peak};
    double stable = sim->stepper->scales ? system_scaled_step(system) : system_stable_step(system);
    double limit = implicit ? CHOOSE_IMPLICIT_STEP : solver->courant * stable;
    bool given = solver->step > 0.0;
    cost.step = given && (implicit || solver->step < limit) ? solver->step : limit;
    cost.seconds = duration / cost.step *
                   (implicit ? choose_implicit_cost(system) : choose_explicit_cost(system));
    if (sim->stepper->sweep_cost > 0.0) {
        cost.seconds *= sim->stepper->sweep_cost * solver->sweeps;
    }
    return cost;
}

static void print_skipped(const Sim *sim, FILE *out) {
    const System *system = &sim->system;
    const AirDef *air = &sim->scene->air;
    bool clamped = false, rest = false;
    for (int c = 0; c < system->cloth_count; c++) {
        clamped = clamped || system->cloths[c].ghost_count > 0;
        const double *curvature = system->cloths[c].panel.rest_curvature;
        rest = rest || curvature[0] != 0.0 || curvature[1] != 0.0;
    }
    if (system->contact.obstacle_count == 0) {
        fprintf(out, "  skipped: obstacle queries (the scene has no obstacle)\n");
    }
    if (!sim->stepper->implicit) {
        fprintf(out, "  skipped: matrices (an explicit step needs none)\n");
    }
    if (!rest) {
        fprintf(out, "  skipped: rest curvature (every panel is flat at rest)\n");
    }
    if (air->drag == 0.0 && !air_has_faces(air)) {
        fprintf(out, "  skipped: air (no drag)\n");
    }
    if (!clamped) {
        fprintf(out, "  skipped: ghost nodes (nothing is clamped)\n");
    }
}

static void print_json(const Sim *sim, const Cost *cost, FILE *out) {
    fprintf(out,
            "{\"schema\": \"toile-check-1\", \"scene\": \"%s\", \"unknowns\": %d, "
            "\"stepper\": \"%s\", \"step_s\": %.6g, \"frames\": %d, \"cpu_s\": %.3g, "
            "\"memory_mb\": %.3g, \"cloths\": [",
            sim->scene->title, 3 * sim->system.node_count, sim->stepper->name, cost->step,
            sim->scene->film.frame_count, cost->seconds, cost->megabytes);
    for (int c = 0; c < sim->system.cloth_count; c++) {
        const Cloth *cloth = &sim->system.cloths[c];
        fprintf(out,
                "%s{\"name\": \"%s\", \"model\": \"%s\", \"nodes\": %d, \"lattice\": [%d, %d], "
                "\"wraps\": %s}",
                c ? ", " : "", cloth->def->name, cloth->model->name, cloth->node_count,
                cloth->panel.nu, cloth->panel.nv, cloth->panel.wrap ? "true" : "false");
    }
    fputs("], \"reference\": [", out);
    for (int i = 0; i < sim->scene->reference_count; i++) {
        const ReferenceDef *r = &sim->scene->references[i];
        fprintf(out, "%s{\"cloth\": %d, \"at\": [%.17g, %.17g], \"is\": [%.17g, %.17g, %.17g]}",
                i ? ", " : "", r->cloth, r->at[0], r->at[1], r->is.x, r->is.y, r->is.z);
    }
    fputs("]}\n", out);
}

void plan_print(const Sim *sim, FILE *out, bool json) {
    const System *system = &sim->system;
    Cost cost = estimate(sim);
    if (json) {
        print_json(sim, &cost, out);
        return;
    }
    fprintf(out, "%s: %d cloth%s, %d obstacle%s, %d frames at %g/s\n", sim->scene->path,
            system->cloth_count, system->cloth_count == 1 ? "" : "s",
            system->contact.obstacle_count, system->contact.obstacle_count == 1 ? "" : "s",
            sim->scene->film.frame_count, sim->scene->film.rate);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        const Material *m = &cloth->material;
        double g = 9.80665, length = cbrt(0.5 * (m->d11 + m->d22) / (m->density * g));
        fprintf(out, "  cloth '%s': model %s, %d nodes%s, spacing %.3g x %.3g mm\n",
                cloth->def->name, cloth->model->name, cloth->node_count,
                cloth->panel.nu > 0 ? " on a lattice" : " scattered", 1e3 * cloth->panel.h1,
                1e3 * cloth->panel.h2);
        if (cloth->def->accuracy > 0.0) {
            fprintf(out, "    accuracy %g %%: spacing chosen as %.3g mm\n",
                    100.0 * cloth->def->accuracy, 1e3 * panel_accurate_spacing(cloth->def));
        }
        if (cloth->note) {
            fprintf(out, "    %s: %s\n", cloth->model->name, cloth->note);
        }
        fprintf(out,
                "    fabric %s: %.4g g/m2, bending length %.3g mm, spacing / bending length "
                "%.2g\n",
                cloth->def->fabric.name, 1e3 * m->density, 1e3 * length, cloth->panel.h1 / length);
    }
    fprintf(out, "  unknowns: %d\n", 3 * system->node_count);
    fprintf(out, "  stepper: %s (%s), step %.3g ms\n", sim->stepper->name, sim->stepper_why,
            1e3 * cost.step);
    if (!sim->stepper->implicit) {
        fprintf(out, "  vector code: %s\n", sweep_kernel_best()->name);
    }
    print_skipped(sim, out);
    fprintf(out, "  estimate: %.*f CPU s, %.0f MB\n", cost.seconds < 10.0 ? 1 : 0, cost.seconds,
            ceil(cost.megabytes));
}

static void print_contact(const Sim *sim, FILE *out) {
    const Statistics *t = &sim->total;
    fprintf(out,
            "sim: impulses %.0f, shortened moves %.0f, searches %.0f; last frame: %.0f pairs "
            "listed, %.0f near\n",
            t->impulses, t->truncations, t->rebuilds, sim->statistics.pairs,
            sim->statistics.evaluations);
    if (sim->system.contact.impulses) {
        fprintf(out, "sim: collisions in %.0f rounds, %.0f impact zones of %.0f vertices\n",
                t->rounds, t->zones, t->zone_vertices);
    }
    fprintf(out,
            "sim: friction took %.3g J, contact damping %.3g J, the guard %.3g J, "
            "the bound on sides %.3g J\n",
            t->friction, t->damping, t->guard, t->sides);
    fprintf(out, "sim: %.0f %% of the time for contact, %.0f %% for its lists\n",
            100.0 * t->contact_seconds / fmax(t->seconds, 1e-9),
            100.0 * t->search_seconds / fmax(t->seconds, 1e-9));
}

/* gap: [m] INFINITY: nothing was near */
static void print_gap(const char *what, double gap, FILE *out) {
    if (isfinite(gap)) {
        fprintf(out, "%s %.3g mm", what, 1e3 * gap);
    } else {
        fprintf(out, "%s: none was near", what);
    }
}

void plan_print_summary(const Sim *sim, FILE *out, bool json) {
    const Statistics *t = &sim->total;
    if (json) {
        fprintf(out,
                "{\"schema\": \"toile-sim-1\", \"frames\": %d, \"stepper\": \"%s\", \"steps\": "
                "%.0f, \"retries\": %.0f, \"factorisations\": %.0f, \"cpu_s\": %.4g, "
                "\"state_hash\": \"%016llx\"}\n",
                sim->frame + 1, sim->stepper->name, t->steps, t->retries, t->factorisations, t->cpu,
                (unsigned long long)sim_state_hash(sim));
        return;
    }
    fprintf(out, "sim: %d frames, %.0f steps of %.3g ms (%s), %.3g CPU s\n", sim->frame + 1,
            t->steps, 1e3 * t->step_length, sim->stepper->name, t->cpu);
    fprintf(out, "sim: taken back %.0f, factorisations %.0f, work of handles %.3g J\n", t->retries,
            t->factorisations, t->work);
    if (sim->system.contact.obstacle_count > 0) {
        print_gap("sim: smallest gap to an obstacle", t->smallest_gap, out);
        fprintf(out, ", lag %.2g s\n", t->lag);
    }
    if (sim->system.contact.self) {
        print_gap("sim: smallest gap of cloth to cloth", t->smallest_self_gap, out);
        fputc('\n', out);
    }
    if (system_has_contact(&sim->system)) {
        print_contact(sim, out);
    }
    fprintf(out, "sim: damping inside the fabric took %.3g J, of the mass and by air %.3g J",
            t->fabric, t->drag);
    if (t->numerical != 0.0) {
        fprintf(out, ", %s %.3g J",
                sim->stepper->implicit ? "the implicit steps" : "scaled inertia", t->numerical);
    }
    fputc('\n', out);
}
