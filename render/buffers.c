/* Geometry and constants in the driver's memory. */
#include <stddef.h>

#include "render/passes.h"
#include "render/surfel.h"

/* A plane that is not the floor is drawn as a square of this half side. */
#define PLANE_SCALES 3.0 /* of the scale */

static GLuint create_buffer(GLenum target, GLsizeiptr bytes, const void *data, GLenum usage) {
    GLuint buffer = 0;
    gl.GenBuffers(1, &buffer);
    gl.BindBuffer(target, buffer);
    gl.BufferData(target, bytes, data, usage);
    return buffer;
}

GLuint buffers_create_block(GLsizeiptr bytes, const void *data) {
    return create_buffer(GL_UNIFORM_BUFFER, bytes, data, GL_DYNAMIC_DRAW);
}

static void set_attribute(GLuint number, int components, size_t stride, size_t offset) {
    gl.EnableVertexAttribArray(number);
    gl.VertexAttribPointer(number, components, GL_FLOAT, GL_FALSE, (GLsizei)stride,
                           (const void *)offset);
}

static GLsizeiptr triangle_bytes(int count) { return 3 * (GLsizeiptr)sizeof(uint32_t) * count; }

/* The surfels that have clip lines. */
static void create_surfels(Painter *painter, const Surface *surface) {
    SurfaceBuffers *cloth = &painter->cloth;
    Arena scratch = {0};
    uint32_t *list = arena_push(&scratch, uint32_t, 3 * (size_t)surface->vertex_count);
    int count = 0;
    cloth->cut_begin = arena_push(&painter->arena, int, surface->part_count + 1);
    for (int i = 0; i < surface->part_count; i++) {
        const SurfacePart *part = &surface->parts[i];
        for (int v = part->vertex_begin; v < part->vertex_begin + part->vertex_count; v++) {
            for (int corner = 0; corner < 3 && surface->surfels[v].cut > 0.0f; corner++) {
                list[count++] = 3 * (uint32_t)v + (uint32_t)corner;
            }
        }
        cloth->cut_begin[i + 1] = count;
    }
    cloth->surfels =
        create_buffer(GL_ARRAY_BUFFER, surface->vertex_count * (GLsizeiptr)sizeof(Surfel),
                      surface->surfels, GL_DYNAMIC_DRAW);
    cloth->folds = create_buffer(GL_ARRAY_BUFFER, 0, NULL, GL_STREAM_DRAW);
    cloth->cut =
        create_buffer(GL_ARRAY_BUFFER, count * (GLsizeiptr)sizeof *list, list, GL_STATIC_DRAW);
    cloth->bends = create_buffer(GL_ARRAY_BUFFER, 0, NULL, GL_STREAM_DRAW);
    cloth->slopes = surface->slopes ? create_buffer(GL_ARRAY_BUFFER, 0, NULL, GL_STREAM_DRAW) : 0;
    arena_free(&scratch);
}

/* [m] of a repeat of the picture on a cloth. */
static void set_print(const Painter *painter, int cloth, const SurfacePart *part,
                      LookPanel *panel) {
    const Print *print = painter->def.prints ? &painter->def.prints[cloth] : NULL;
    if (print && print->image) {
        panel->print[0] = print->width > 0.0 ? print->width : part->size[0];
        panel->print[1] = panel->print[0] * print->image->height / print->image->width;
    }
}

void buffers_create_cloth(Painter *painter, const Surface *surface) {
    SurfaceBuffers *cloth = &painter->cloth;
    GLsizeiptr count = surface->vertex_count;
    gl.GenVertexArrays(1, &cloth->array);
    gl.BindVertexArray(cloth->array);
    cloth->vertices = create_buffer(GL_ARRAY_BUFFER, count * (GLsizeiptr)sizeof(SurfaceVertex),
                                    NULL, GL_STREAM_DRAW);
    set_attribute(0, 3, sizeof(SurfaceVertex), offsetof(SurfaceVertex, position));
    set_attribute(1, 3, sizeof(SurfaceVertex), offsetof(SurfaceVertex, normal));
    set_attribute(2, 3, sizeof(SurfaceVertex), offsetof(SurfaceVertex, tangent));
    cloth->uv = create_buffer(GL_ARRAY_BUFFER, count * 2 * (GLsizeiptr)sizeof(float), surface->uv,
                              GL_STATIC_DRAW);
    set_attribute(3, 2, 2 * sizeof(float), 0);
    if (surface->values) {
        cloth->values =
            create_buffer(GL_ARRAY_BUFFER, count * (GLsizeiptr)sizeof(float), NULL, GL_STREAM_DRAW);
        set_attribute(4, 1, sizeof(float), 0);
    }
    gl.BindVertexArray(0);
    if (surface->surfels) {
        create_surfels(painter, surface);
    }
    cloth->fine = create_buffer(GL_ARRAY_BUFFER, triangle_bytes(surface->fine_count), surface->fine,
                                GL_STATIC_DRAW);
    cloth->coarse = create_buffer(GL_ARRAY_BUFFER, triangle_bytes(surface->coarse_count),
                                  surface->coarse, GL_STATIC_DRAW);
    cloth->blocks = arena_push(&painter->arena, GLuint, surface->part_count);
    for (int i = 0; i < surface->part_count; i++) {
        const SurfacePart *part = &surface->parts[i];
        const Look *look = painter->looks[i];
        if (look->quantity != QUANTITY_NONE) {
            MeasuredBlock block = look_measured_block(look, painter->ranges[look->quantity]);
            cloth->blocks[i] = buffers_create_block(sizeof block, &block);
        } else {
            LookPanel panel = {part->size[0], part->size[1],   painter->thickness[i],
                               part->around,  part->rectangle, {0.0, 0.0}};
            set_print(painter, i, part, &panel);
            ClothBlock block = look_cloth_block(look, &panel);
            cloth->blocks[i] = buffers_create_block(sizeof block, &block);
        }
    }
    cloth->uploaded = true;
}

/* Which surfels are drawn, and the triangles in place of the others. */
static void upload_folds(SurfaceBuffers *cloth, const Surface *surface) {
    if (surface->fold_count == 0 && !cloth->folded) {
        return;
    }
    gl.BindBuffer(GL_ARRAY_BUFFER, cloth->surfels);
    gl.BufferData(GL_ARRAY_BUFFER, surface->vertex_count * (GLsizeiptr)sizeof(Surfel),
                  surface->surfels, GL_DYNAMIC_DRAW);
    gl.BindBuffer(GL_ARRAY_BUFFER, cloth->folds);
    gl.BufferData(GL_ARRAY_BUFFER, triangle_bytes(surface->fold_count), surface->folds,
                  GL_STREAM_DRAW);
    cloth->folded = surface->fold_count > 0;
}

void buffers_upload_cloth(Painter *painter, const Surface *surface) {
    GLsizeiptr bytes = surface->vertex_count * (GLsizeiptr)sizeof(SurfaceVertex);
    gl.BindBuffer(GL_ARRAY_BUFFER, painter->cloth.vertices);
    gl.BufferData(GL_ARRAY_BUFFER, bytes, surface->vertices, GL_STREAM_DRAW);
    if (painter->cloth.bends) {
        gl.BindBuffer(GL_ARRAY_BUFFER, painter->cloth.bends);
        gl.BufferData(GL_ARRAY_BUFFER, 6 * surface->vertex_count * (GLsizeiptr)sizeof(float),
                      surface->bends, GL_STREAM_DRAW);
    }
    if (painter->cloth.folds) {
        upload_folds(&painter->cloth, surface);
    }
    if (painter->cloth.slopes) {
        gl.BindBuffer(GL_ARRAY_BUFFER, painter->cloth.slopes);
        gl.BufferData(GL_ARRAY_BUFFER, 2 * surface->vertex_count * (GLsizeiptr)sizeof(float),
                      surface->slopes, GL_STREAM_DRAW);
    }
    if (painter->cloth.values) {
        gl.BindBuffer(GL_ARRAY_BUFFER, painter->cloth.values);
        gl.BufferData(GL_ARRAY_BUFFER, surface->vertex_count * (GLsizeiptr)sizeof(float),
                      surface->values, GL_STREAM_DRAW);
    }
}

void buffers_destroy_cloth(Painter *painter) {
    SurfaceBuffers *cloth = &painter->cloth;
    if (!cloth->uploaded) {
        return;
    }
    GLuint buffers[] = {cloth->vertices, cloth->uv,   cloth->values, cloth->surfels,
                        cloth->cut,      cloth->fine, cloth->coarse, cloth->bends,
                        cloth->slopes,   cloth->folds};
    gl.DeleteBuffers(sizeof buffers / sizeof *buffers, buffers);
    gl.DeleteBuffers(painter->def.cloth_count, cloth->blocks);
    gl.DeleteVertexArrays(1, &cloth->array);
    *cloth = (SurfaceBuffers){0};
}

static StageBox box_of(const SolidMesh *mesh) {
    return (StageBox){vec3(mesh->low[0], mesh->low[1], mesh->low[2]),
                      vec3(mesh->high[0], mesh->high[1], mesh->high[2])};
}

static void create_prop(Painter *painter, int number) {
    const PaintProp *prop = &painter->props[number];
    PropBuffers *buffers = &painter->prop_buffers[number];
    Arena scratch = {0};
    double extent = PLANE_SCALES * painter->def.camera.scale;
    SolidMesh mesh = prop->mesh
                         ? solid_mesh_from_triangles(prop->mesh, prop->mesh->vertices, &scratch)
                         : solid_mesh_create(&prop->solid, extent, &scratch);
    PropBlock block = look_prop_block(prop->look);
    gl.GenVertexArrays(1, &buffers->array);
    gl.BindVertexArray(buffers->array);
    buffers->vertices =
        create_buffer(GL_ARRAY_BUFFER, mesh.vertex_count * (GLsizeiptr)sizeof(SolidVertex),
                      mesh.vertices, GL_STATIC_DRAW);
    set_attribute(0, 3, sizeof(SolidVertex), offsetof(SolidVertex, position));
    set_attribute(1, 3, sizeof(SolidVertex), offsetof(SolidVertex, normal));
    buffers->triangles = create_buffer(GL_ELEMENT_ARRAY_BUFFER, triangle_bytes(mesh.triangle_count),
                                       mesh.triangles, GL_STATIC_DRAW);
    gl.BindVertexArray(0);
    buffers->block = buffers_create_block(sizeof block, &block);
    buffers->triangle_count = mesh.triangle_count;
    buffers->box = box_of(&mesh);
    arena_free(&scratch);
}

void buffers_move_prop(Painter *painter, int prop, const double *vertices) {
    PropBuffers *buffers = &painter->prop_buffers[prop];
    Arena scratch = {0};
    SolidMesh mesh = solid_mesh_from_triangles(painter->props[prop].mesh, vertices, &scratch);
    gl.BindBuffer(GL_ARRAY_BUFFER, buffers->vertices);
    gl.BufferData(GL_ARRAY_BUFFER, mesh.vertex_count * (GLsizeiptr)sizeof(SolidVertex),
                  mesh.vertices, GL_STREAM_DRAW);
    buffers->box = box_of(&mesh);
    arena_free(&scratch);
}

void buffers_create_props(Painter *painter) {
    painter->prop_buffers = arena_push(&painter->arena, PropBuffers, painter->def.prop_count);
    for (int i = 0; i < painter->def.prop_count; i++) {
        create_prop(painter, i);
    }
}

void buffers_destroy_props(Painter *painter) {
    for (int i = 0; painter->prop_buffers && i < painter->def.prop_count; i++) {
        PropBuffers *buffers = &painter->prop_buffers[i];
        GLuint names[] = {buffers->vertices, buffers->triangles, buffers->block};
        gl.DeleteBuffers(3, names);
        gl.DeleteVertexArrays(1, &buffers->array);
    }
}

void buffers_draw_cloth(const Painter *painter, int first, int count, bool fine) {
    gl.BindVertexArray(painter->cloth.array);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, fine ? painter->cloth.fine : painter->cloth.coarse);
    gl.DrawElements(GL_TRIANGLES, 3 * count, GL_UNSIGNED_INT,
                    (const void *)(size_t)triangle_bytes(first));
}

void buffers_draw_folds(const Painter *painter, int first, int count) {
    gl.BindVertexArray(painter->cloth.array);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, painter->cloth.folds);
    gl.DrawElements(GL_TRIANGLES, 3 * count, GL_UNSIGNED_INT,
                    (const void *)(size_t)triangle_bytes(first));
}

void buffers_draw_prop(const Painter *painter, int prop) {
    if (!painter->props[prop].hidden) {
        const PropBuffers *buffers = &painter->prop_buffers[prop];
        gl.BindVertexArray(buffers->array);
        gl.DrawElements(GL_TRIANGLES, 3 * buffers->triangle_count, GL_UNSIGNED_INT, NULL);
    }
}
