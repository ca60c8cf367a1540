#include "render/drape_report.h"

#include <math.h>
#include <string.h>

#include "render/json.h"

#define DEGREE (PI / 180.0)

static const char *const strain_names[3] = {"strain_warp", "strain_weft", "shear_rad"};

/* ---- text ---- */

static void line(FILE *out, const char *name, double value, const char *unit) {
    if (isfinite(value)) {
        fprintf(out, "%-24s %.5g%s%s\n", name, value, unit[0] ? " " : "", unit);
    }
}

static void print_nodes(const Drape *drape, FILE *out) {
    fprintf(out, "%-24s %d", "nodes", drape->nodes.count);
    if (drape->nodes_least != drape->nodes_most) {
        fprintf(out, " (%d to %d, by how much a fold must stand out)", drape->nodes_least,
                drape->nodes_most);
    }
    fputs(drape->nodes.count ? ", at" : "", out);
    for (int i = 0; i < drape->nodes.count; i++) {
        fprintf(out, " %.0f", drape->nodes.angle[i] / DEGREE);
    }
    fputs(drape->nodes.count ? " deg from warp\n" : "\n", out);
}

static void print_billows(const DrapeCut *cut, FILE *out) {
    fprintf(out, "%-24s %d", "billows", cut->count);
    fputs(cut->count ? ", at" : "", out);
    for (int i = 0; i < cut->count; i++) {
        fprintf(out, " %.0f", cut->billows[i].angle / DEGREE);
    }
    fprintf(out, "%s, more than %.3g mm out in the cut %.3g mm below the top\n",
            cut->count ? " deg from warp" : "", 1e3 * cut->prominence, 1e3 * cut->depth);
    if (cut->corners > 0) {
        const int *at = cut->at_corner;
        const double *skew = cut->skew;
        fprintf(out, "%-24s %d %d %d %d billows, skew %.2f %.2f %.2f %.2f, common %.2f\n",
                "  at the corners", at[0], at[1], at[2], at[3], skew[0], skew[1], skew[2], skew[3],
                cut->skew_common);
    }
}

void drape_print_text(const Drape *drape, double settling, FILE *out) {
    char text[160];
    fprintf(out, "%s (%s), frame %d, %.4g s\n", drape->cloth, drape->fabric, drape->frame,
            drape->time);
    line(out, "specimen radius", 1e3 * drape->specimen, "mm");
    line(out, "support radius", 1e3 * drape->support.radius, "mm");
    line(out, "drape coefficient", drape->dc, "%");
    line(out, "  from geometry", drape->dc_geometry, "%");
    print_nodes(drape, out);
    line(out, "node spacing, scatter", 100 * drape->node_spacing_cv, "%");
    line(out, "fold depth", 1e3 * drape->fold_depth, "mm");
    line(out, "drape-distance ratio", drape->ddr, "%");
    line(out, "fold depth index", drape->fold_index, "%");
    line(out, "circularity", drape->circularity, "");
    fprintf(out, "%-24s n = %d, %.1f mm, %.0f %% of all\n", "strongest harmonic",
            drape->harmonics.dominant, 1e3 * drape->harmonics.amplitude[drape->harmonics.dominant],
            100 * drape->harmonics.share[drape->harmonics.dominant]);
    print_billows(&drape->cut, out);
    fprintf(out, "%-24s %.2g %% in warp and weft, %.2g %% in the diagonals\n", "asymmetry",
            100 * drape->asymmetry[0], 100 * drape->asymmetry[1]);
    line(out, "rim over support, mean", 1e3 * drape->rim_mean, "mm");
    line(out, "  lowest", 1e3 * drape->rim_low, "mm");
    line(out, "  highest", 1e3 * drape->rim_high, "mm");
    line(out, "lowest point", 1e3 * drape->lowest, "mm");
    line(out, "sag", 1e3 * (drape->highest - drape->lowest), "mm");
    line(out, "rim stretch", 100 * drape->rim_stretch, "%");
    line(out, "area strain", 100 * drape->area_strain, "%");
    for (int k = 0; k < 3; k++) {
        fprintf(out, "%-24s %.3g %.3g %.3g (5, 50, 95 %% of the vertices)\n", strain_names[k],
                drape->strain[k][1], drape->strain[k][2], drape->strain[k][3]);
    }
    line(out, "kinetic energy / weight R", drape->kinetic, "");
    line(out, "at rest from", settling, "s");
    if (*drape_warning(drape, text, sizeof text)) {
        fprintf(out, "warning: %s\n", text);
    }
}

/* ---- JSON ---- */

static void entry(FILE *out, const char *name, double value) {
    fprintf(out, ",\n  \"%s\": ", name);
    json_number(out, value);
}

static void list(FILE *out, const char *name, const double *values, int count, double scale) {
    fprintf(out, ",\n  \"%s\": [", name);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", " : "", out);
        json_number(out, scale * values[i]);
    }
    fputc(']', out);
}

static void print_slices(const Drape *drape, FILE *out) {
    fprintf(out, ",\n  \"slices\": [");
    for (int i = 0; i < DRAPE_SLICES; i++) {
        const DrapeSlice *slice = &drape->slices[i];
        fprintf(out, "%s{\"depth_m\": %.9g, \"nodes\": %d, \"rays_missed\": %d, \"mean_m\": ",
                i ? ", " : "", slice->depth, slice->nodes, slice->missed);
        json_number(out, slice->mean);
        fputs(", \"low_m\": ", out);
        json_number(out, slice->low);
        fputs(", \"high_m\": ", out);
        json_number(out, slice->high);
        fputc('}', out);
    }
    fputc(']', out);
}

static void print_head(const Drape *drape, FILE *out) {
    fprintf(out, "{\"schema\": \"toile-drape-1\",\n  \"cloth\": ");
    json_string(out, drape->cloth);
    fputs(", \"fabric\": ", out);
    json_string(out, drape->fabric);
    fputs(", \"support\": ", out);
    json_string(out, drape->support.name);
    fprintf(out, ", \"frame\": %d", drape->frame);
    entry(out, "time_s", drape->time);
    entry(out, "specimen_radius_m", drape->specimen);
    entry(out, "support_radius_m", drape->support.radius);
    fprintf(out, ",\n  \"centre_m\": [%.9g, %.9g], \"plane_m\": %.9g", drape->support.centre[0],
            drape->support.centre[1], drape->support.plane);
}

static void print_shape(const Drape *drape, FILE *out) {
    const Nodes *nodes = &drape->nodes;
    fprintf(out, ",\n  \"nodes\": %d, \"nodes_least\": %d, \"nodes_most\": %d", nodes->count,
            drape->nodes_least, drape->nodes_most);
    list(out, "node_angles_deg", nodes->angle, nodes->count, 1.0 / DEGREE);
    list(out, "node_peaks_m", nodes->peak, nodes->count, 1.0);
    list(out, "node_depths_m", nodes->depth, nodes->count, 1.0);
    entry(out, "node_spacing_cv", drape->node_spacing_cv);
    entry(out, "fold_depth_m", drape->fold_depth);
    entry(out, "drape_distance_ratio_percent", drape->ddr);
    entry(out, "fold_depth_index_percent", drape->fold_index);
    entry(out, "circularity", drape->circularity);
    entry(out, "contour_mean_m", drape->harmonics.mean);
    list(out, "harmonic_amplitudes_m", drape->harmonics.amplitude + 1, CONTOUR_HARMONICS, 1.0);
    list(out, "harmonic_phases_deg", drape->harmonics.phase + 1, CONTOUR_HARMONICS, 1.0 / DEGREE);
    list(out, "harmonic_shares", drape->harmonics.share + 1, CONTOUR_HARMONICS, 1.0);
    fprintf(out, ",\n  \"dominant_harmonic\": %d, \"rays_multivalued\": %d, \"rays_missed\": %d",
            drape->harmonics.dominant, drape->contour.multivalued, drape->contour.missed);
}

static void print_cut(const DrapeCut *cut, FILE *out) {
    double columns[3][DRAPE_MOST_BILLOWS], at_corner[4];
    for (int i = 0; i < cut->count; i++) {
        columns[0][i] = cut->billows[i].angle / DEGREE;
        columns[1][i] = cut->billows[i].off;
        columns[2][i] = cut->billows[i].prominence;
    }
    fprintf(out, ",\n  \"billows\": %d", cut->count);
    list(out, "billow_angles_deg", columns[0], cut->count, 1.0);
    list(out, "billow_distances_m", columns[1], cut->count, 1.0);
    list(out, "billow_prominences_m", columns[2], cut->count, 1.0);
    for (int k = 0; k < cut->corners; k++) {
        at_corner[k] = cut->at_corner[k];
    }
    list(out, "billows_at_corners", at_corner, cut->corners, 1.0);
    list(out, "corner_skews", cut->skew, cut->corners, 1.0);
    entry(out, "corner_skew_common", cut->corners > 0 ? cut->skew_common : NAN);
    entry(out, "cut_depth_m", cut->depth);
    entry(out, "prominence_m", cut->prominence);
}

void drape_print_json(const Drape *drape, double settling, FILE *out) {
    char text[160];
    print_head(drape, out);
    entry(out, "area_specimen_m2", drape->area_specimen);
    entry(out, "area_support_m2", drape->area_disc);
    entry(out, "area_silhouette_m2", drape->area);
    entry(out, "area_geometry_m2", drape->area_signed);
    entry(out, "drape_coefficient_percent", drape->dc);
    entry(out, "drape_coefficient_geometry_percent", drape->dc_geometry);
    entry(out, "undercut_points", drape->undercut);
    print_shape(drape, out);
    entry(out, "rim_height_mean_m", drape->rim_mean);
    entry(out, "rim_height_low_m", drape->rim_low);
    entry(out, "rim_height_high_m", drape->rim_high);
    entry(out, "rim_fold_depth_m", drape->rim_fold_depth);
    fprintf(out, ",\n  \"rim_nodes\": %d", drape->rim_nodes);
    print_slices(drape, out);
    print_cut(&drape->cut, out);
    entry(out, "asymmetry_warp_weft", drape->asymmetry[0]);
    entry(out, "asymmetry_diagonals", drape->asymmetry[1]);
    entry(out, "lowest_m", drape->lowest);
    entry(out, "sag_m", drape->highest - drape->lowest);
    entry(out, "rim_stretch", drape->rim_stretch);
    entry(out, "area_strain", drape->area_strain);
    for (int k = 0; k < 3; k++) {
        list(out, strain_names[k], drape->strain[k], DRAPE_PERCENTILES, 1.0);
    }
    fputs(",\n  \"strain_percentiles\": [0, 5, 50, 95, 100]", out);
    entry(out, "kinetic_over_weight_radius", drape->kinetic);
    entry(out, "settle_time_s", settling);
    fputs(",\n  \"warning\": ", out);
    json_string(out, drape_warning(drape, text, sizeof text));
    fputs("}", out);
}

/* ---- CSV ---- */

void drape_print_csv_head(FILE *out) {
    fprintf(out, "frame,time_s,dc_percent,dc_geometry_percent,nodes,fold_depth_m,circularity,"
                 "contour_mean_m,rim_height_mean_m,lowest_m,sag_m,rim_stretch,area_strain,"
                 "strain_warp_p95,strain_weft_p95,shear_p95_rad,kinetic_over_weight_radius\n");
}

void drape_print_csv(const Drape *drape, FILE *out) {
    double values[] = {drape->dc_geometry,    drape->nodes.count,
                       drape->fold_depth,     drape->circularity,
                       drape->harmonics.mean, drape->rim_mean,
                       drape->lowest,         drape->highest - drape->lowest,
                       drape->rim_stretch,    drape->area_strain,
                       drape->strain[0][3],   drape->strain[1][3],
                       drape->strain[2][3],   drape->kinetic};
    fprintf(out, "%d,%.9g", drape->frame, drape->time);
    isfinite(drape->dc) ? fprintf(out, ",%.9g", drape->dc) : fputc(',', out);
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        isfinite(values[i]) ? fprintf(out, ",%.9g", values[i]) : fputc(',', out);
    }
    fputc('\n', out);
}

void drape_print_contour(const Drape *drape, FILE *out) {
    fputs("theta_deg,r_m\n", out);
    for (int i = 0; i < 360; i++) {
        fprintf(out, "%d,%.9g\n", i, drape->contour.r[i * CONTOUR_RAYS / 360]);
    }
}

void drape_print_harmonics(const Drape *drape, FILE *out) {
    fputs("n,amplitude_m,phase_deg,share\n", out);
    for (int n = 1; n <= CONTOUR_HARMONICS; n++) {
        fprintf(out, "%d,%.9g,%.9g,%.9g\n", n, drape->harmonics.amplitude[n],
                drape->harmonics.phase[n] / DEGREE, drape->harmonics.share[n]);
    }
}

/* ---- ensembles ---- */

/* Student's t at 97.5 % [Abramowitz, Stegun 1964, table 26.10]; degrees of freedom 1, 2, ... */
static double student(int freedom) {
    static const double t[] = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306,
                               2.262,  2.228, 2.201, 2.179, 2.160, 2.145, 2.131};
    const int known = sizeof t / sizeof *t;
    double n = freedom, z = 1.959964; /* beyond the table: expansion in 1 / n */
    return freedom <= known ? t[freedom - 1]
                            : z + (z * z * z + z) / (4.0 * n) +
                                  (5.0 * pow(z, 5) + 16.0 * z * z * z + 3.0 * z) / (96.0 * n * n);
}

Ensemble ensemble_find(const Drape *drapes, int count) {
    Ensemble e = {.count = count, .half_interval = NAN, .deviation = NAN};
    for (int i = 0; i < count; i++) {
        e.mean += drapes[i].dc / count;
        e.modes[drapes[i].nodes.count]++;
    }
    if (count > 1) {
        double sum = 0.0;
        for (int i = 0; i < count; i++) {
            sum += (drapes[i].dc - e.mean) * (drapes[i].dc - e.mean);
        }
        e.deviation = sqrt(sum / (count - 1));
        e.half_interval = student(count - 1) * e.deviation / sqrt(count);
    }
    for (int n = 0; n <= CONTOUR_MOST_NODES; n++) {
        e.mode = e.modes[n] > e.modes[e.mode] ? n : e.mode;
    }
    for (int i = 0; i < count; i++) {
        e.dc_mode += drapes[i].nodes.count == e.mode ? drapes[i].dc / e.modes[e.mode] : 0.0;
    }
    return e;
}

void ensemble_print_text(const Ensemble *e, FILE *out) {
    fprintf(out, "%d runs: drape coefficient %.2f %%", e->count, e->mean);
    if (e->count > 1) {
        fprintf(out, ", scatter %.2f, 95 %% interval of the mean +- %.2f", e->deviation,
                e->half_interval);
    }
    fprintf(out, "\nnodes:");
    for (int n = 0; n <= CONTOUR_MOST_NODES; n++) {
        if (e->modes[n] > 0) {
            fprintf(out, " %d in %d", n, e->modes[n]);
        }
    }
    fprintf(out, "; the most frequent, %d, has %.2f %%\n", e->mode, e->dc_mode);
}

void ensemble_print_json(const Ensemble *e, FILE *out) {
    fprintf(out, "{\"runs\": %d", e->count);
    entry(out, "dc_mean_percent", e->mean);
    entry(out, "dc_deviation_points", e->deviation);
    entry(out, "dc_half_interval_points", e->half_interval);
    fprintf(out, ",\n  \"node_mode\": %d", e->mode);
    entry(out, "dc_mode_percent", e->dc_mode);
    fputs(",\n  \"node_histogram\": {", out);
    for (int n = 0, first = 1; n <= CONTOUR_MOST_NODES; n++) {
        if (e->modes[n] > 0) {
            fprintf(out, "%s\"%d\": %d", first ? "" : ", ", n, e->modes[n]);
            first = 0;
        }
    }
    fputs("}}", out);
}
