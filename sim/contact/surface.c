#include "sim/contact/surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* a side of a triangle, while edges are made */
typedef struct Side {
    int low, high, number; /* places; 3 t + k */
} Side;

/* All sides in the order of their ends, equal ones in that of their triangles: dealt to their lower ends, of which
 * each has few. */
static Side *sort_sides(const Surface *s, int places, Arena *scratch) {
    int count = 3 * s->triangle_count, *end = arena_push(scratch, int, places + 1);
    Side *sorted = arena_push(scratch, Side, count);
    for (int i = 0; i < count; i++) {
        int a = s->triangles[i], b = s->triangles[i / 3 * 3 + (i + 1) % 3];
        end[(a < b ? a : b) + 1]++;
    }
    for (int place = 0; place < places; place++) {
        end[place + 1] += end[place];
    }
    int *begin = arena_push(scratch, int, places);
    memcpy(begin, end, (size_t)places * sizeof *begin);
    for (int i = 0; i < count; i++) {
        int a = s->triangles[i], b = s->triangles[i / 3 * 3 + (i + 1) % 3];
        Side side = {a < b ? a : b, a < b ? b : a, i};
        int at = end[side.low]++;
        for (; at > begin[side.low] && sorted[at - 1].high > side.high; at--) {
            sorted[at] = sorted[at - 1];
        }
        sorted[at] = side;
    }
    return sorted;
}

/* all edges; edge_of[3 t + k]: of a side of triangle t */
static void make_edges(Surface *s, const Side *sides, int *edge_of, Arena *arena) {
    int count = 3 * s->triangle_count;
    s->edges = arena_push(arena, int, 2 * count);
    s->sides = arena_push(arena, int, count);
    for (int i = 0; i < count; i++) {
        bool fresh =
            i == 0 || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high;
        if (fresh) {
            s->edges[2 * s->edge_count] = sides[i].low;
            s->edges[2 * s->edge_count + 1] = sides[i].high;
            s->edge_count++;
        }
        s->sides[sides[i].number] = fresh ? s->edge_count - 1 : -1;
        edge_of[sides[i].number] = s->edge_count - 1;
    }
}

/* Partner of every triangle, -1: alone. Those of a lattice come in pairs from its first one on; others pair
 * greedily. */
static void pair_triangles(const Surface *s, const int *edge_of, int *partner, Arena *arena) {
    int *holder = arena_push(arena, int, s->edge_count); /* 1 + unpaired triangle at the edge */
    int at = 0;
    for (int p = 0; p < s->panel_count; p++) {
        int end = at + s->panels[p].triangle_count;
        for (int t = at; t < end; t++) {
            bool lattice = s->panels[p].nu > 0;
            if (lattice) {
                partner[t] = at + ((t - at) ^ 1);
                continue;
            }
            partner[t] = -1;
            for (int k = 0; k < 3 && partner[t] < 0; k++) {
                int other = holder[edge_of[3 * t + k]] - 1;
                if (other >= 0 && partner[other] < 0) {
                    partner[t] = other, partner[other] = t;
                }
            }
            for (int k = 0; k < 3; k++) {
                holder[edge_of[3 * t + k]] = t + 1;
            }
        }
        at = end;
    }
}

/* ---- groups ---- */

typedef struct Cut {
    double key;
    int cell;
} Cut;

static int by_key(const void *a, const void *b) {
    const Cut *p = a, *q = b;
    return p->key != q->key ? (p->key < q->key ? -1 : 1) : p->cell - q->cell;
}

static Vec3 triangle_centre(const Surface *s, const double *start, int t) {
    Vec3 sum = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        sum = vec3_add(sum, vec3_load(start + 3 * (size_t)s->triangles[3 * t + k]));
    }
    return vec3_scale(1.0 / 3.0, sum);
}

/* halves a set of cells along its longest extent until it fits a group */
static void cut_cells(const Surface *s, const double *start, const SurfaceCell *cells, Cut *cut,
                      int count, int *group_of, int *groups) {
    if (count <= SURFACE_GROUP_CELLS) {
        for (int i = 0; i < count; i++) {
            group_of[cut[i].cell] = *groups;
        }
        (*groups)++;
        return;
    }
    Box box = box_empty();
    for (int i = 0; i < count; i++) {
        box_add(&box, triangle_centre(s, start, cells[cut[i].cell].triangle[0]));
    }
    Vec3 e = vec3_sub(box.high, box.low);
    for (int i = 0; i < count; i++) {
        Vec3 c = triangle_centre(s, start, cells[cut[i].cell].triangle[0]);
        cut[i].key = e.x >= e.y && e.x >= e.z ? c.x : e.y >= e.z ? c.y : c.z;
    }
    qsort(cut, (size_t)count, sizeof *cut, by_key);
    cut_cells(s, start, cells, cut, count / 2, group_of, groups);
    cut_cells(s, start, cells, cut + count / 2, count - count / 2, group_of, groups);
}

/* group of every cell of panel p, from 0; returns their number */
static int group_panel(Surface *s, int p, const double *start, const SurfaceCell *cells, int begin,
                       int end, int *group_of, Arena *arena) {
    const SurfacePanel *panel = &s->panels[p];
    if (panel->nu > 0) {
        int across = panel->wrap ? panel->nu : panel->nu - 1;
        s->blocks[2 * p] = (across + SURFACE_BLOCK - 1) / SURFACE_BLOCK;
        s->blocks[2 * p + 1] = (panel->nv - 1 + SURFACE_BLOCK - 1) / SURFACE_BLOCK;
        for (int c = begin; c < end; c++) {
            int i = (c - begin) % across / SURFACE_BLOCK, j = (c - begin) / across / SURFACE_BLOCK;
            group_of[c] = j * s->blocks[2 * p] + i;
        }
        return s->blocks[2 * p] * s->blocks[2 * p + 1];
    }
    ArenaMark mark = arena_mark(arena);
    Cut *cut = arena_push(arena, Cut, end - begin);
    for (int c = begin; c < end; c++) {
        cut[c - begin].cell = c;
    }
    int groups = 0;
    if (end > begin) {
        cut_cells(s, start, cells, cut, end - begin, group_of, &groups);
    }
    arena_rewind(arena, mark);
    return groups;
}

/* sorts the cells by group */
static void make_groups(Surface *s, SurfaceCell *cells, const double *start, Arena *arena,
                        Arena *scratch) {
    int *group_of = arena_push(scratch, int, s->cell_count);
    int begin = 0, end = 0;
    for (int p = 0; p < s->panel_count; p++) {
        int triangles = 0;
        while (end < s->cell_count && triangles < s->panels[p].triangle_count) {
            triangles += cells[end++].triangle_count;
        }
        int made = group_panel(s, p, start, cells, begin, end, group_of, scratch);
        for (int c = begin; c < end; c++) {
            group_of[c] += s->first_group[p];
        }
        s->first_group[p + 1] = s->first_group[p] + made;
        begin = end;
    }
    s->group_count = s->first_group[s->panel_count];
    s->groups = arena_push(arena, SurfaceGroup, s->group_count);
    for (int c = 0; c < s->cell_count; c++) {
        s->groups[group_of[c]].cell_end++;
    }
    int at = 0;
    for (int g = 0; g < s->group_count; g++) {
        SurfaceGroup *group = &s->groups[g];
        group->cell_begin = at;
        at += group->cell_end;
        group->cell_end = group->cell_begin;
    }
    for (int c = 0; c < s->cell_count; c++) {
        s->cells[s->groups[group_of[c]].cell_end++] = cells[c];
    }
    for (int p = 0; p < s->panel_count; p++) {
        for (int g = s->first_group[p]; g < s->first_group[p + 1]; g++) {
            int local = g - s->first_group[p], across = s->blocks[2 * p];
            s->groups[g].panel = p;
            s->groups[g].block[0] = across > 0 ? local % across : -1;
            s->groups[g].block[1] = across > 0 ? local / across : -1;
        }
    }
}

static void add_corner(SurfaceCell *cell, int vertex) {
    for (int k = 0; k < cell->corner_count; k++) {
        if (cell->corner[k] == vertex) {
            return;
        }
    }
    cell->corner[cell->corner_count++] = vertex;
}

/* each vertex and edge goes to the first cell that has it */
static void deal_features(Surface *s, const int *edge_of, int places, Arena *scratch) {
    unsigned char *vertex_taken = arena_push(scratch, unsigned char, places);
    unsigned char *edge_taken = arena_push(scratch, unsigned char, s->edge_count);
    for (int c = 0; c < s->cell_count; c++) {
        SurfaceCell *cell = &s->cells[c];
        for (int k = 0; k < 3 * cell->triangle_count; k++) {
            int side = 3 * cell->triangle[k / 3] + k % 3;
            int vertex = s->triangles[side], edge = edge_of[side];
            add_corner(cell, vertex);
            if (!vertex_taken[vertex]) {
                cell->vertex[cell->vertex_count++] = vertex;
            }
            if (!edge_taken[edge]) {
                cell->edge[cell->edge_count++] = edge;
            }
            vertex_taken[vertex] = edge_taken[edge] = 1;
        }
    }
}

static void list_vertices(Surface *s, int places, Arena *arena, Arena *scratch) {
    int *seen = arena_push(scratch, int, places), total = 0;
    s->group_vertices = arena_push(arena, int, 3 * s->triangle_count);
    for (int g = 0; g < s->group_count; g++) {
        SurfaceGroup *group = &s->groups[g];
        group->vertex_begin = total;
        for (int c = group->cell_begin; c < group->cell_end; c++) {
            for (int k = 0; k < s->cells[c].corner_count; k++) {
                int vertex = s->cells[c].corner[k];
                if (seen[vertex] != g + 1) {
                    s->group_vertices[total++] = vertex;
                }
                seen[vertex] = g + 1;
            }
        }
        group->vertex_end = total;
    }
}

static SurfaceCell *make_cells(Surface *s, const int *partner, Arena *scratch) {
    SurfaceCell *cells = arena_push(scratch, SurfaceCell, s->triangle_count);
    for (int t = 0; t < s->triangle_count; t++) {
        if (partner[t] >= 0 && partner[t] < t) {
            continue;
        }
        SurfaceCell *cell = &cells[s->cell_count++];
        cell->triangle[cell->triangle_count++] = t;
        if (partner[t] > t) {
            cell->triangle[cell->triangle_count++] = partner[t];
        }
    }
    return cells;
}

Surface surface_create(const SurfacePanel *panels, int panel_count, const double *start,
                       Arena *arena) {
    Surface s = {.panel_count = panel_count, .panels = panels};
    Arena scratch = {0};
    int places = 0, at = 0;
    for (int p = 0; p < panel_count; p++) {
        int end = panels[p].first + panels[p].vertex_count;
        places = end > places ? end : places;
        s.triangle_count += panels[p].triangle_count;
    }
    s.panel_of = arena_push(arena, int, places);
    s.triangles = arena_push(arena, int, 3 * s.triangle_count);
    for (int p = 0; p < panel_count; p++) {
        for (int i = 0; i < panels[p].vertex_count; i++) {
            s.panel_of[panels[p].first + i] = p;
        }
        for (int k = 0; k < 3 * panels[p].triangle_count; k++) {
            s.triangles[at++] = panels[p].first + panels[p].triangles[k];
        }
    }
    s.first_group = arena_push(arena, int, panel_count + 1);
    s.blocks = arena_push(arena, int, 2 * panel_count);
    int *edge_of = arena_push(&scratch, int, 3 * s.triangle_count);
    make_edges(&s, sort_sides(&s, places, &scratch), edge_of, arena);
    int *partner = arena_push(&scratch, int, s.triangle_count);
    pair_triangles(&s, edge_of, partner, &scratch);
    SurfaceCell *cells = make_cells(&s, partner, &scratch);
    s.cells = arena_push(arena, SurfaceCell, s.cell_count);
    make_groups(&s, cells, start, arena, &scratch);
    deal_features(&s, edge_of, places, &scratch);
    list_vertices(&s, places, arena, &scratch);
    arena_free(&scratch);
    return s;
}

double surface_lattice_altitude(const SurfacePanel *panel) {
    return panel->h1 * panel->h2 / hypot(panel->h1, panel->h2);
}
