#include "sim/tester_strip.h"

#include <math.h>

bool strip_create(Strip *s, const Fabric *fabric, const char *model, StripWay way,
                  const double size[2], const int nodes[2], bool pulled, Error *error) {
    *s = (Strip){.def = cloth_default(), .scene = scene_default()};
    bool weft = way == STRIP_WEFT;
    s->weft = weft;
    s->along = nodes[0], s->across = nodes[1];
    s->def.name = "specimen";
    s->def.fabric = *fabric;
    s->def.fabric.bend_poisson.value = 0.0; /* rigidities are those of strips */
    s->def.fabric.bend_hysteresis.value = 0.0;
    s->def.fabric.shear_hysteresis.value = s->def.fabric.shear_hysteresis5.value = 0.0;
    s->def.model = model;
    s->def.shape.kind = SHAPE_RECTANGLE;
    s->def.shape.width = size[weft ? 1 : 0];
    s->def.shape.height = size[weft ? 0 : 1];
    s->def.nodes[0] = nodes[weft ? 1 : 0];
    s->def.nodes[1] = nodes[weft ? 0 : 1];
    /* weft along x: the panel turns by -90 degrees about z */
    s->def.pose.turn = quat_from_axis_angle(vec3(0, 0, 1), weft ? -0.5 * PI : 0.0);
    s->def.pose.shift = vec3(0.5 * size[0], 0, 0);
    for (int k = 0; k < 2; k++) {
        s->ends[k] = handle_default();
        s->ends[k].kind = pulled ? HANDLE_HOLD : HANDLE_CLAMP;
    }
    s->ends[0].region = weft ? REGION_BOTTOM : REGION_LEFT;
    s->ends[1].region = weft ? REGION_TOP : REGION_RIGHT;
    s->scene.path = s->scene.text = s->scene.title = "";
    s->scene.cloth_count = 1;
    s->scene.cloths = &s->def;
    s->scene.handle_count = pulled ? 2 : 1;
    s->scene.handles = s->ends;
    s->scene.solver.self_contact = false;
    if (pulled) {
        s->scene.gravity = vec3(0, 0, 0);
    }
    if (!system_create(&s->system, &s->scene, 1, &s->arena, error)) {
        strip_destroy(s);
        return false;
    }
    s->state = state_allocate(&s->system, &s->arena);
    state_start(&s->system, &s->state);
    return true;
}

void strip_destroy(Strip *s) { arena_free(&s->arena); }

int strip_node(const Strip *s, int i, int j) {
    return s->weft ? i * s->across + j : j * s->along + i;
}

double strip_share(const Strip *s, int j) {
    return (j == 0 || j == s->across - 1 ? 0.5 : 1.0) / (s->across - 1);
}
