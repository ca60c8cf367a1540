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
