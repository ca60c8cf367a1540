#include <math.h>
#include <string.h>

#include "sim/scene/fabric_schema.h"

static const FabricNumber *number_of(const Fabric *fabric, const FabricRow *row) {
    return (const FabricNumber *)((const char *)fabric + row->offset);
}

static double length_mm(const Fabric *fabric, const FabricNumber *rigidity) {
    return 1e3 * fabric_bending_length(fabric, rigidity->value);
}

/* text in quotes, or null */
static void json_text(FILE *out, const char *text) {
    if (!text) {
        fputs("null", out);
        return;
    }
    fputc('"', out);
    for (const char *p = text; *p; p++) {
        if (*p == '"' || *p == '\\') {
            fprintf(out, "\\%c", *p);
        } else if ((unsigned char)*p < 32) {
            fprintf(out, "\\u%04x", (unsigned)*p);
        } else {
            fputc(*p, out);
        }
    }
    fputc('"', out);
}

static void json_number(FILE *out, double value) {
    if (isfinite(value)) {
        fprintf(out, "%.9g", value);
    } else {
        fputs("null", out);
    }
}

static void json_field(FILE *out, const char *key, const char *text) {
    fprintf(out, "\"%s\": ", key);
    json_text(out, text);
    fputs(", ", out);
}

static void json_row(FILE *out, const char *name, const FabricNumber *number, const char *unit) {
    fprintf(out, "    \"%s\": {\"value\": ", name);
    json_number(out, number->value);
    fputs(", \"unit\": ", out);
    json_text(out, unit);
    fputs(", \"low\": ", out);
    json_number(out, number->low);
    fputs(", \"high\": ", out);
    json_number(out, number->high);
    fputs(", ", out);
    json_field(out, "flag", fabric_flag_names[number->flag]);
    json_field(out, "written", number->written);
    json_field(out, "note", number->note);
    fputs("\"from\": ", out);
    json_text(out, number->from);
    fputs("}", out);
}

static void json_drapes(FILE *out, const Fabric *fabric) {
    fputs("  \"drape\": [", out);
    for (int i = 0; i < fabric->drape_count; i++) {
        const FabricDrape *drape = &fabric->drapes[i];
        fprintf(out, "%s{\"coefficient\": %.9g, \"nodes\": %d, \"specimen_m\": ", i ? ", " : "",
                drape->coefficient, drape->nodes);
        json_number(out, drape->specimen);
        fputs(", \"disc_m\": ", out);
        json_number(out, drape->disc);
        fprintf(out, ", \"flag\": \"%s\", \"geometry\": \"%s\"}", fabric_flag_names[drape->flag],
                fabric_flag_names[drape->geometry]);
    }
    fputs("],\n", out);
}

/* one object without the braces around several */
static void json_fabric(FILE *out, const Fabric *fabric) {
    fputs("{", out);
    json_field(out, "name", fabric->name);
    json_field(out, "about", fabric->about);
    json_field(out, "source", fabric->source);
    json_field(out, "doi", fabric->doi);
    json_field(out, "read", fabric->read);
    json_field(out, "licence", fabric->licence);
    fputs("\n  \"numbers\": {\n", out);
    for (const FabricRow *row = fabric_rows; row->name; row++) {
        json_row(out, row->name, number_of(fabric, row), row->unit);
        fputs(row[1].name ? ",\n" : "},\n", out);
    }
    json_drapes(out, fabric);
    fprintf(out, "  \"bending_length_mm\": [%.4g, %.4g], \"warnings\": [",
            length_mm(fabric, &fabric->bend_warp), length_mm(fabric, &fabric->bend_weft));
    for (int i = 0; i < fabric->warning_count; i++) {
        fputs(i ? ", " : "", out);
        json_text(out, fabric->warnings[i]);
    }
    fputs("]}", out);
}

static void print_row(FILE *out, const FabricRow *row, const FabricNumber *number) {
    char si[48] = "never";
    if (isfinite(number->value)) {
        snprintf(si, sizeof si, "%.4g %s", number->value, row->unit);
    }
    fprintf(out, "  %-19s %-18s %-20s %-10s", row->name, si, number->written ? number->written : "",
            fabric_flag_names[number->flag]);
    if (isfinite(number->low) || isfinite(number->high)) {
        fprintf(out, " %.3g .. %.3g;", number->low, number->high);
    }
    if (number->from) {
        fprintf(out, " %s", number->from);
    }
    if (number->note) {
        fprintf(out, "%s %s", number->from ? ";" : "", number->note);
    }
    fputc('\n', out);
}

static void print_material(FILE *out, const Fabric *fabric) {
    Material material = fabric_material(fabric);
    fprintf(out,
            "  bending length      %.1f mm warp, %.1f mm weft\n"
            "  membrane [N/m]      C11 %.4g, C12 %.4g, C22 %.4g, C66 %.4g\n"
            "  bending [uN m]      D11 %.4g, D12 %.4g, D22 %.4g, D66 %.4g\n",
            length_mm(fabric, &fabric->bend_warp), length_mm(fabric, &fabric->bend_weft),
            material.c11, material.c12, material.c22, material.c66, 1e6 * material.d11,
            1e6 * material.d12, 1e6 * material.d22, 1e6 * material.d66);
}

static void print_drapes(FILE *out, const Fabric *fabric) {
    for (int i = 0; i < fabric->drape_count; i++) {
        const FabricDrape *drape = &fabric->drapes[i];
        fprintf(out, "  drape               %.1f %%, ", 100.0 * drape->coefficient);
        if (drape->nodes > 0) {
            fprintf(out, "%d nodes ", drape->nodes);
        }
        fprintf(out, "(%s)", fabric_flag_names[drape->flag]);
        if (!isnan(drape->specimen) && !isnan(drape->disc)) {
            fprintf(out, ", %.1f cm on a disc of %.1f cm (%s)", 100.0 * drape->specimen,
                    100.0 * drape->disc, fabric_flag_names[drape->geometry]);
        }
        fputc('\n', out);
    }
}

static void print_curves(FILE *out, const Fabric *fabric) {
    static const char *const names[FABRIC_CURVES] = {"curve warp [1/m, N]", "curve weft [1/m, N]",
                                                     "shear [rad, N/m]"};
    for (int k = 0; k < FABRIC_CURVES; k++) {
        const FabricCurve *curve = &fabric->curves[k];
        if (curve->count > 0) {
            fprintf(out, "  %-19s ", names[k]);
        }
        for (int i = 0; i < curve->count; i++) {
            fprintf(out, "%s%.4g, %.4g", i ? "; " : "", curve->at[i], curve->value[i]);
        }
        fputs(curve->count > 0 ? "\n" : "", out);
    }
}

static void print_fabric(FILE *out, const Fabric *fabric) {
    fprintf(out, "%s%s%s\n", fabric->name, fabric->about ? ": " : "",
            fabric->about ? fabric->about : "");
    fprintf(out, "  source              %s", fabric->source ? fabric->source : "not stated");
    fprintf(out, "%s%s", fabric->doi ? ", doi " : "", fabric->doi ? fabric->doi : "");
    fprintf(out, "%s%s\n", fabric->read ? "; read " : "", fabric->read ? fabric->read : "");
    fprintf(out, "  licence             %s\n", fabric->licence ? fabric->licence : "not stated");
    fprintf(out, "\n  %-19s %-18s %-20s %s\n", "number", "SI", "as written", "known");
    for (const FabricRow *row = fabric_rows; row->name; row++) {
        print_row(out, row, number_of(fabric, row));
    }
    fputc('\n', out);
    print_material(out, fabric);
    print_curves(out, fabric);
    print_drapes(out, fabric);
    for (int i = 0; i < fabric->warning_count; i++) {
        fprintf(out, "%s\n", fabric->warnings[i]);
    }
}

static void print_line(FILE *out, const Fabric *fabric) {
    char drape[32] = "";
    if (fabric->drape_count > 0) {
        snprintf(drape, sizeof drape, "%.1f %%", 100.0 * fabric->drapes[0].coefficient);
    }
    fprintf(out, "%-20s %6.1f %6.2f %11.1f %8.0f %6.0f %7s  %-9s  %s\n", fabric->name,
            1e3 * fabric->weight.value, 1e3 * fabric->thickness.value,
            0.5 * (length_mm(fabric, &fabric->bend_warp) + length_mm(fabric, &fabric->bend_weft)),
            0.5 * (fabric->stretch_warp.value + fabric->stretch_weft.value), fabric->shear.value,
            drape, fabric_flag_names[fabric->bend_warp.flag], fabric->about ? fabric->about : "");
}

bool fabric_print_list(FILE *out, bool json, Error *error) {
    Arena arena = {0};
    const char *const *names = fabric_names(&arena);
    if (!names[0]) {
        error_set(error, EXIT_MISSING_INPUT, "no fabrics in %s", source_asset(&arena, "fabrics"));
        arena_free(&arena);
        return false;
    }
    bool ok = true;
    fputs(
        json ? "{\"schema\": \"toile-fabrics-1\", \"fabrics\": [\n"
             : "name                   g/m2     mm  bending mm  stretch  shear   drape  bending    "
               "about\n",
        out);
    for (int i = 0; names[i] && ok; i++) {
        Fabric fabric;
        ok = fabric_read(names[i], &arena, &fabric, error);
        if (ok && json) {
            fputs(i ? ",\n" : "", out);
            json_fabric(out, &fabric);
        } else if (ok) {
            print_line(out, &fabric);
        }
    }
    fputs(json ? "]}\n" : "", out);
    arena_free(&arena);
    return ok;
}

bool fabric_print(const char *name, FILE *out, bool json, Error *error) {
    Arena arena = {0};
    Fabric fabric;
    bool ok = fabric_read(name, &arena, &fabric, error);
    if (ok && json) {
        fputs("{\"schema\": \"toile-fabrics-1\", \"fabrics\": [\n", out);
        json_fabric(out, &fabric);
        fputs("]}\n", out);
    } else if (ok) {
        print_fabric(out, &fabric);
    }
    arena_free(&arena);
    return ok;
}
