#include "sim/summary.h"

#include <math.h>

#define MUCH_BY_METHOD 0.25 /* share of the energy lost, from which on motion looks damped */
#define LEAST_PERCENT 0.5   /* of the energy lost or gained: less is not worth a word */

typedef struct Term {
    const char *name;
    double value; /* not finite: there is none */
} Term;

/* ---- JSON ---- */

static void print_object(const char *name, const Term *terms, int count, FILE *out) {
    fprintf(out, ", \"%s\": {", name);
    for (int k = 0; k < count; k++) {
        fprintf(out, "%s\"%s\": ", k ? ", " : "", terms[k].name);
        if (isfinite(terms[k].value)) {
            fprintf(out, "%.4g", terms[k].value);
        } else {
            fputs("null", out);
        }
    }
    fputc('}', out);
}

static void print_json(const Sim *sim, FILE *out) {
    const Statistics *t = &sim->total, *last = &sim->statistics;
    const Term quality[] = {{"smallest_gap_m", t->smallest_gap},
                            {"smallest_self_gap_m", t->smallest_self_gap},
                            {"lag_s", t->lag},
                            {"stretch", t->stretch},
                            {"behind", t->behind},
                            {"end_stretch", last->stretch}};
    const Term energy[] = {{"handles", t->work},    {"friction", t->friction},
                           {"contact", t->damping}, {"fabric", t->fabric},
                           {"drag", t->drag},       {"guard", t->guard},
                           {"sides", t->sides},     {"steps", t->numerical}};
    const Term contact[] = {{"seconds", t->contact_seconds},
                            {"search_seconds", t->search_seconds},
                            {"impulses", t->impulses},
                            {"shortened", t->truncations},
                            {"searches", t->rebuilds},
                            {"rounds", t->rounds},
                            {"zones", t->zones},
                            {"zone_vertices", t->zone_vertices},
                            {"last_listed", last->pairs},
                            {"last_near", last->evaluations}};
    fprintf(out,
            "{\"schema\": \"toile-sim-1\", \"frames\": %d, \"asleep\": %.0f, \"stepper\": \"%s\", "
            "\"steps\": %.0f, \"retries\": %.0f, \"factorisations\": %.0f, \"seconds\": %.4g, "
            "\"cpu_s\": %.4g",
            sim->frame + 1, t->asleep, sim->stepper->name, t->steps, t->retries, t->factorisations,
            t->seconds, t->cpu);
    print_object("quality", quality, sizeof quality / sizeof *quality, out);
    print_object("energy_j", energy, sizeof energy / sizeof *energy, out);
    print_object("contact", contact, sizeof contact / sizeof *contact, out);
    fprintf(out, ", \"state_hash\": \"%016llx\"}\n", (unsigned long long)sim_state_hash(sim));
}

/* ---- text ---- */

/* of a time [s] in plain figures */
static int decimals(double time) { return time < 10.0 ? 2 : time < 100.0 ? 1 : 0; }

static void print_cost(const Sim *sim, FILE *out) {
    const Statistics *t = &sim->total;
    fprintf(out, "sim: %d frames, to t = %.4g s, in %.*f s (%.*f CPU s", sim->frame + 1,
            sim->state.time, decimals(t->seconds), t->seconds, decimals(t->cpu), t->cpu);
    if (t->contact_seconds > 0.0) {
        fprintf(out, ", %.0f %% for contact", 100.0 * t->contact_seconds / fmax(t->seconds, 1e-9));
    }
    fputs(")\n", out);
}

static void print_steps(const Sim *sim, FILE *out) {
    const Statistics *t = &sim->total;
    fprintf(out, "sim: %.0f steps by '%s'", t->steps, sim->stepper->name);
    if (t->step_length > 0.0) {
        fprintf(out, ", the last of %.3g ms", 1e3 * t->step_length);
    }
    if (t->retries > 0.0) {
        fprintf(out, "; %.0f did not do and were made again, shorter", t->retries);
    }
    if (t->asleep > 0.0) {
        fprintf(out, "; cloth at rest in %.0f frames, which need none", t->asleep);
    }
    fputc('\n', out);
}

/* gap: [m] INFINITY: nothing was ever near enough to push */
static void print_gap(const char *what, double gap, double distance, FILE *out) {
    bool near = isfinite(gap);
    fprintf(out, "%s %s%.3g mm", what, near ? "" : "over ", 1e3 * (near ? gap : distance));
}

static void print_contact(const Sim *sim, FILE *out) {
    const ContactDef *contact = &sim->system.contact;
    const Statistics *t = &sim->total;
    bool obstacles = contact->obstacle_count > 0;
    fputs("sim: nothing crossed; least gap", out);
    if (obstacles) {
        print_gap(" to an obstacle", t->smallest_gap, contact->distance, out);
    }
    if (contact->self) {
        print_gap(obstacles ? ", of cloth to cloth" : " of cloth to cloth", t->smallest_self_gap,
                  contact->distance, out);
    }
    fprintf(out, " (below %.3g mm they push)\n", 1e3 * contact->distance);
    if (t->lag > 0.0) {
        fprintf(out, "sim: an obstacle waited for pinched cloth, up to %.2g s behind its motion\n",
                t->lag);
    }
    if (t->behind > contact->distance) {
        fprintf(out, "sim: cloth could not follow its handles everywhere: up to %.3g mm behind\n",
                1e3 * t->behind);
    }
}

static void print_stretch(const Sim *sim, FILE *out) {
    if (sim->total.stretch > 0.0) {
        fprintf(out, "sim: stretched along its threads by up to %.2g %%, at the end %.2g %%\n",
                100.0 * sim->total.stretch, 100.0 * fmax(0.0, sim->statistics.stretch));
    }
}

/* Terms of this sign that are worth a word; returns their sum, [J]. */
static double print_terms_of(const Term *terms, int count, double sign, const char *what,
                             FILE *out) {
    double sum = 0.0;
    for (int k = 0; k < count; k++) {
        sum += fmax(0.0, sign * terms[k].value);
    }
    const char *next = what;
    for (int k = 0; k < count; k++) {
        double joules = sign * terms[k].value, percent = 100.0 * joules / sum;
        if (percent >= LEAST_PERCENT) {
            fprintf(out, "%s %s %.3g J (%.0f %%)", next, terms[k].name, joules, percent);
            next = ",";
        }
    }
    return sum;
}

/* Energy by what took it, or gave it, as wind does. The last is what no cloth would lose. */
static void print_energy(const Statistics *t, FILE *out) {
    double method = t->guard + t->sides + t->numerical;
    const Term terms[] = {{"friction", t->friction},
                          {"impacts", t->damping},
                          {"damping inside the fabric", t->fabric},
                          {"air and 'damping'", t->drag},
                          {"handles", -t->work},
                          {"the computation itself", method}};
    int count = sizeof terms / sizeof *terms;
    double lost = print_terms_of(terms, count, 1.0, "sim: energy lost to", out);
    if (method > MUCH_BY_METHOD * lost) {
        fputs("; shorter steps take less", out);
    }
    fputs(lost > 0.0 ? "\n" : "", out);
    double gained = print_terms_of(terms, count, -1.0, "sim: energy gained from", out);
    fputs(gained > 0.0 ? "\n" : "", out);
}

void summary_print(const Sim *sim, FILE *out, bool json) {
    if (json) {
        print_json(sim, out);
        return;
    }
    print_cost(sim, out);
    print_steps(sim, out);
    if (system_has_contact(&sim->system)) {
        print_contact(sim, out);
    }
    print_stretch(sim, out);
    print_energy(&sim->total, out);
}
