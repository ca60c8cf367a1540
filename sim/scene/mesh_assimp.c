#include "sim/scene/mesh_assimp.h"

#include <assimp/cfileio.h>
#include <assimp/cimport.h>
#include <assimp/metadata.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/base/arena.h"
#include "sim/scene/mesh_import.h"

#define MOST_NODES 20000
#define MOST_DEPTH 500        /* of the tree of nodes: the walk below recurses */
#define TICKS_WITHOUT_RATE 25 /* [1/s] assimp's own choice when a file does not say */

const char *mesh_import_version(void) {
    static char text[32];
    snprintf(text, sizeof text, "assimp %u.%u.%u", aiGetVersionMajor(), aiGetVersionMinor(),
             aiGetVersionPatch());
    return text;
}

/* ---- affine maps, rows of 4 ---- */

typedef struct Affine {
    double m[3][4];
} Affine;

static Affine affine_of(const struct aiMatrix4x4 *m) {
    return (Affine){
        {{m->a1, m->a2, m->a3, m->a4}, {m->b1, m->b2, m->b3, m->b4}, {m->c1, m->c2, m->c3, m->c4}}};
}

static Affine affine_multiply(const Affine *a, const Affine *b) {
    Affine c;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            c.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] +
                        a->m[i][2] * b->m[2][j] + (j == 3 ? a->m[i][3] : 0.0);
        }
    }
    return c;
}

static void affine_add(const Affine *a, const double p[3], double weight, double sum[3]) {
    for (int i = 0; i < 3; i++) {
        sum[i] += weight * (a->m[i][0] * p[0] + a->m[i][1] * p[1] + a->m[i][2] * p[2] + a->m[i][3]);
    }
}

static Affine affine_from(const double shift[3], const double q[4], const double scale[3]) {
    double w = q[0], x = q[1], y = q[2], z = q[3];
    double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                         {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                         {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    Affine a;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            a.m[i][j] = turn[i][j] * scale[j];
        }
        a.m[i][3] = shift[i];
    }
    return a;
}

/* ---- the tree of nodes as lists ---- */

typedef struct Node {
    const struct aiNode *node;
    int parent; /* -1 */
    const struct aiNodeAnim *channel;
    const struct aiMeshMorphAnim *morph;
    Affine world;
} Node;

/* One mesh at one node, and where its vertices go. */
typedef struct Instance {
    const struct aiMesh *mesh;
    int node;
    int first;       /* vertex */
    int *bone_nodes; /* (mNumBones) */
} Instance;

typedef struct Import {
    const MeshJob *job;
    const struct aiScene *scene;
    const struct aiAnimation *animation; /* NULL: as it stands */
    Arena arena;
    Node *nodes;
    int node_count;
    Instance *instances;
    int instance_count;
    int64_t vertex_count, triangle_count;
    double *positions; /* (vertex_count x 3) of one frame */
    double *weights;   /* (vertex_count) sum of the bones' */
    int out;
    MeshReply reply;
} Import;

static bool fail(Import *import, const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool fail(Import *import, const char *format, ...) {
    if (!import->reply.text[0]) {
        va_list list;
        va_start(list, format);
        vsnprintf(import->reply.text, sizeof import->reply.text, format, list);
        va_end(list);
    }
    return false;
}

static const struct aiNodeAnim *find_channel(const struct aiAnimation *animation,
                                             const struct aiString *name) {
    for (unsigned i = 0; animation && i < animation->mNumChannels; i++) {
        if (strcmp(animation->mChannels[i]->mNodeName.data, name->data) == 0) {
            return animation->mChannels[i];
        }
    }
    return NULL;
}

static const struct aiMeshMorphAnim *find_morph(const struct aiAnimation *animation,
                                                const struct aiString *name) {
    for (unsigned i = 0; animation && i < animation->mNumMorphMeshChannels; i++) {
        if (strcmp(animation->mMorphMeshChannels[i]->mName.data, name->data) == 0) {
            return animation->mMorphMeshChannels[i];
        }
    }
    return NULL;
}

/* Parents come before children. */
static bool list_nodes(Import *import, const struct aiNode *node, int parent, int depth) {
    if (import->node_count >= MOST_NODES || depth > MOST_DEPTH) {
        return fail(import, "it has more than %d nodes, or nested deeper than %d", MOST_NODES,
                    MOST_DEPTH);
    }
    int index = import->node_count++;
    import->nodes[index] = (Node){.node = node,
                                  .parent = parent,
                                  .channel = find_channel(import->animation, &node->mName),
                                  .morph = find_morph(import->animation, &node->mName)};
    import->instance_count += (int)node->mNumMeshes;
    for (unsigned i = 0; i < node->mNumChildren; i++) {
        if (!node->mChildren[i] || !list_nodes(import, node->mChildren[i], index, depth + 1)) {
            return fail(import, "its nodes form no tree");
        }
    }
    return true;
}

static int find_node(const Import *import, const struct aiString *name) {
    for (int i = 0; i < import->node_count; i++) {
        if (strcmp(import->nodes[i].node->mName.data, name->data) == 0) {
            return i;
        }
    }
    return -1;
}

static bool check_mesh(Import *import, const struct aiMesh *mesh) {
    if (!mesh->mVertices || (mesh->mNumFaces > 0 && !mesh->mFaces)) {
        return fail(import, "an object has no vertices");
    }
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *face = &mesh->mFaces[i];
        for (unsigned k = 0; k < face->mNumIndices; k++) {
            if (face->mIndices[k] >= mesh->mNumVertices) {
                return fail(import, "a face names vertex %u of %u", face->mIndices[k],
                            mesh->mNumVertices);
            }
        }
        import->triangle_count += face->mNumIndices == 3;
    }
    import->vertex_count += mesh->mNumVertices;
    if (import->triangle_count > import->job->most_triangles) {
        return fail(import, "it has more than %d triangles", import->job->most_triangles);
    }
    return 24 * (size_t)import->vertex_count <= import->job->most_bytes ||
           fail(import, "it has %lld vertices, too many", (long long)import->vertex_count);
}

static bool add_instance(Import *import, int node, unsigned number, Instance *instance) {
    if (number >= import->scene->mNumMeshes || !import->scene->mMeshes[number]) {
        return fail(import, "a node names an object that is not there");
    }
    const struct aiMesh *mesh = import->scene->mMeshes[number];
    *instance = (Instance){.mesh = mesh, .node = node, .first = (int)import->vertex_count};
    if (!check_mesh(import, mesh)) {
        return false;
    }
    if (import->job->uv && !mesh->mTextureCoords[0]) {
        return fail(import, "it has no texture coordinates (UV), or not everywhere");
    }
    instance->bone_nodes = arena_push(&import->arena, int, mesh->mNumBones);
    for (unsigned b = 0; b < mesh->mNumBones; b++) {
        const struct aiBone *bone = mesh->mBones[b];
        instance->bone_nodes[b] = find_node(import, &bone->mName);
        if (instance->bone_nodes[b] < 0) {
            return fail(import, "a bone has no node");
        }
        for (unsigned i = 0; i < bone->mNumWeights; i++) {
            if (bone->mWeights[i].mVertexId >= mesh->mNumVertices) {
                return fail(import, "a bone moves a vertex that is not there");
            }
        }
    }
    return true;
}

static bool list_instances(Import *import) {
    import->nodes = arena_push(&import->arena, Node, MOST_NODES);
    if (!import->scene->mRootNode || !list_nodes(import, import->scene->mRootNode, -1, 0)) {
        return fail(import, "it has no nodes");
    }
    if (import->instance_count > import->job->most_triangles) {
        return fail(import, "it has %d objects, too many", import->instance_count);
    }
    import->instances = arena_push(&import->arena, Instance, import->instance_count);
    int at = 0;
    for (int n = 0; n < import->node_count; n++) {
        const struct aiNode *node = import->nodes[n].node;
        for (unsigned i = 0; i < node->mNumMeshes; i++) {
            if (!add_instance(import, n, node->mMeshes[i], &import->instances[at++])) {
                return false;
            }
        }
    }
    return import->triangle_count > 0 || fail(import, "it has no triangles");
}

/* ---- one frame ---- */

/* Index of the last key at or before `time`, and the part of the way to the next. */
#define FIND_KEY(keys, count, time, index, part)                                                   \
    do {                                                                                           \
        index = 0;                                                                                 \
        while (index + 1 < (count) && (keys)[index + 1].mTime <= (time)) {                         \
            index++;                                                                               \
        }                                                                                          \
        part = 0.0;                                                                                \
        if (index + 1 < (count) && (time) > (keys)[index].mTime) {                                 \
            double span = (keys)[index + 1].mTime - (keys)[index].mTime;                           \
            part = span > 0.0 ? ((time) - (keys)[index].mTime) / span : 0.0;                       \
        }                                                                                          \
    } while (0)

static void blend_vectors(const struct aiVectorKey *keys, unsigned count, double time,
                          double value[3]) {
    unsigned i;
    double part;
    if (count == 0 || !keys) {
        return;
    }
    FIND_KEY(keys, count, time, i, part);
    const struct aiVector3D *a = &keys[i].mValue, *b = part > 0.0 ? &keys[i + 1].mValue : a;
    value[0] = a->x + part * ((double)b->x - a->x);
    value[1] = a->y + part * ((double)b->y - a->y);
    value[2] = a->z + part * ((double)b->z - a->z);
}

/* the shorter way along the great circle */
static void blend_turns(const struct aiQuatKey *keys, unsigned count, double time, double q[4]) {
    unsigned i;
    double part;
    if (count == 0 || !keys) {
        return;
    }
    FIND_KEY(keys, count, time, i, part);
    const struct aiQuaternion *a = &keys[i].mValue, *b = part > 0.0 ? &keys[i + 1].mValue : a;
    double p[4] = {a->w, a->x, a->y, a->z}, r[4] = {b->w, b->x, b->y, b->z};
    double cosine = p[0] * r[0] + p[1] * r[1] + p[2] * r[2] + p[3] * r[3];
    double sign = cosine < 0.0 ? -1.0 : 1.0, angle = acos(fmin(fabs(cosine), 1.0));
    double s = sin(angle), from = 1.0 - part, to = part;
    if (s > 1e-6) {
        from = sin((1.0 - part) * angle) / s;
        to = sin(part * angle) / s;
    }
    double length = 0.0;
    for (int k = 0; k < 4; k++) {
        q[k] = from * p[k] + sign * to * r[k];
        length += q[k] * q[k];
    }
    for (int k = 0; k < 4 && length > 0.0; k++) {
        q[k] /= sqrt(length);
    }
}

static Affine local_map(const Node *node, double ticks) {
    const struct aiNodeAnim *channel = node->channel;
    if (!channel) {
        return affine_of(&node->node->mTransformation);
    }
    double shift[3] = {0, 0, 0}, scale[3] = {1, 1, 1}, turn[4] = {1, 0, 0, 0};
    blend_vectors(channel->mPositionKeys, channel->mNumPositionKeys, ticks, shift);
    blend_vectors(channel->mScalingKeys, channel->mNumScalingKeys, ticks, scale);
    blend_turns(channel->mRotationKeys, channel->mNumRotationKeys, ticks, turn);
    return affine_from(shift, turn, scale);
}

static void move_nodes(Import *import, double ticks) {
    for (int i = 0; i < import->node_count; i++) {
        Node *node = &import->nodes[i];
        Affine local = local_map(node, ticks);
        node->world =
            node->parent < 0 ? local : affine_multiply(&import->nodes[node->parent].world, &local);
    }
}

/* weight of morph target `target` */
static double morph_weight(const Node *node, const struct aiMesh *mesh, unsigned target,
                           double ticks) {
    const struct aiMeshMorphAnim *morph = node->morph;
    if (!morph || morph->mNumKeys == 0) {
        return mesh->mAnimMeshes[target]->mWeight;
    }
    unsigned i;
    double part, sum = 0.0;
    FIND_KEY(morph->mKeys, morph->mNumKeys, ticks, i, part);
    for (int side = 0; side < (part > 0.0 ? 2 : 1); side++) {
        const struct aiMeshMorphKey *key = &morph->mKeys[i + (unsigned)side];
        for (unsigned k = 0; k < key->mNumValuesAndWeights; k++) {
            sum += key->mValues[k] == target ? key->mWeights[k] * (side ? part : 1.0 - part) : 0.0;
        }
    }
    return sum;
}

/* the object's own vertices, morphed, before any transform */
static void shape_vertices(const Import *import, const Instance *instance, double ticks,
                           double *shape) {
    const struct aiMesh *mesh = instance->mesh;
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const struct aiVector3D *v = &mesh->mVertices[i];
        shape[3 * i] = v->x, shape[3 * i + 1] = v->y, shape[3 * i + 2] = v->z;
    }
    for (unsigned target = 0; target < mesh->mNumAnimMeshes; target++) {
        const struct aiAnimMesh *other = mesh->mAnimMeshes[target];
        double weight = morph_weight(&import->nodes[instance->node], mesh, target, ticks);
        if (weight == 0.0 || !other->mVertices || other->mNumVertices != mesh->mNumVertices) {
            continue;
        }
        for (unsigned i = 0; i < mesh->mNumVertices; i++) {
            const struct aiVector3D *v = &mesh->mVertices[i], *w = &other->mVertices[i];
            shape[3 * i] += weight * ((double)w->x - v->x);
            shape[3 * i + 1] += weight * ((double)w->y - v->y);
            shape[3 * i + 2] += weight * ((double)w->z - v->z);
        }
    }
}

/* A vertex follows its bones: sum of w world(bone) offset v over the sum of w; vertices without
 * bones follow the node. */
static void place_instance(Import *import, const Instance *instance, const double *shape) {
    const struct aiMesh *mesh = instance->mesh;
    double *positions = import->positions + 3 * (size_t)instance->first;
    double *weights = import->weights + instance->first;
    memset(positions, 0, 3 * sizeof *positions * mesh->mNumVertices);
    memset(weights, 0, sizeof *weights * mesh->mNumVertices);
    for (unsigned b = 0; b < mesh->mNumBones; b++) {
        const struct aiBone *bone = mesh->mBones[b];
        Affine offset = affine_of(&bone->mOffsetMatrix);
        Affine map = affine_multiply(&import->nodes[instance->bone_nodes[b]].world, &offset);
        for (unsigned i = 0; i < bone->mNumWeights; i++) {
            unsigned v = bone->mWeights[i].mVertexId;
            double weight = bone->mWeights[i].mWeight;
            affine_add(&map, shape + 3 * (size_t)v, weight, positions + 3 * (size_t)v);
            weights[v] += weight;
        }
    }
    const Affine *world = &import->nodes[instance->node].world;
    for (unsigned v = 0; v < mesh->mNumVertices; v++) {
        if (weights[v] > 0.0) {
            for (int k = 0; k < 3; k++) {
                positions[3 * v + (unsigned)k] /= weights[v];
            }
        } else {
            memset(positions + 3 * v, 0, 3 * sizeof *positions);
            affine_add(world, shape + 3 * (size_t)v, 1.0, positions + 3 * (size_t)v);
        }
    }
}

/* ---- the answer ---- */

static bool send_bytes(Import *import, const void *data, size_t bytes) {
    const char *at = data;
    while (bytes > 0) {
        ssize_t sent = write(import->out, at, bytes);
        if (sent < 0 && errno != EINTR) {
            return false;
        }
        at += sent > 0 ? sent : 0;
        bytes -= sent > 0 ? (size_t)sent : 0;
    }
    return true;
}

static bool send_triangles(Import *import) {
    int32_t *triangles = arena_push(&import->arena, int32_t, 3 * (size_t)import->triangle_count);
    int32_t *at = triangles;
    for (int i = 0; i < import->instance_count; i++) {
        const Instance *instance = &import->instances[i];
        for (unsigned f = 0; f < instance->mesh->mNumFaces; f++) {
            const struct aiFace *face = &instance->mesh->mFaces[f];
            for (unsigned k = 0; face->mNumIndices == 3 && k < 3; k++) {
                *at++ = instance->first + (int)face->mIndices[k];
            }
        }
    }
    return send_bytes(import, triangles, 3 * sizeof *triangles * (size_t)import->triangle_count);
}

static void place_uv(Import *import) {
    for (int i = 0; i < import->instance_count; i++) {
        const struct aiMesh *mesh = import->instances[i].mesh;
        double *to = import->positions + 3 * (size_t)import->instances[i].first;
        for (unsigned k = 0; k < mesh->mNumVertices; k++, to += 3) {
            to[0] = mesh->mTextureCoords[0][k].x, to[1] = mesh->mTextureCoords[0][k].y, to[2] = 0.0;
        }
    }
}

static bool send_frames(Import *import, double ticks_per_second) {
    size_t count = 3 * (size_t)import->vertex_count;
    unsigned most = 0;
    for (int i = 0; i < import->instance_count; i++) {
        unsigned own = import->instances[i].mesh->mNumVertices;
        most = own > most ? own : most;
    }
    double *shape = arena_push(&import->arena, double, 3 * (size_t)most);
    import->positions = arena_push(&import->arena, double, count);
    import->weights = arena_push(&import->arena, double, import->vertex_count);
    for (int64_t f = 0; f < import->reply.frame_count; f++) {
        double ticks = (double)f / import->job->rate * ticks_per_second;
        move_nodes(import, ticks);
        for (int i = 0; i < import->instance_count; i++) {
            shape_vertices(import, &import->instances[i], ticks, shape);
            place_instance(import, &import->instances[i], shape);
        }
        if (import->job->uv && f == 1) {
            place_uv(import);
        }
        if (!send_bytes(import, import->positions, count * sizeof(double))) {
            return false;
        }
    }
    return true;
}

/* Frames until the animation ends; one without an animation. */
static bool choose_frames(Import *import, double *ticks_per_second) {
    const struct aiAnimation *animation = import->animation;
    import->reply.frame_count = import->job->uv ? 2 : 1;
    *ticks_per_second = 0.0;
    if (animation) {
        double ticks =
            animation->mTicksPerSecond > 0.0 ? animation->mTicksPerSecond : TICKS_WITHOUT_RATE;
        double frames = ceil(animation->mDuration / ticks * import->job->rate) + 1.0;
        if (!(frames >= 1.0) || !isfinite(ticks)) {
            return fail(import, "its animation has no length");
        }
        int64_t wanted = import->job->frame_count;
        import->reply.frame_count = frames < (double)wanted ? (int64_t)frames : wanted;
        *ticks_per_second = ticks;
    }
    size_t bytes = 24 * (size_t)import->vertex_count * (size_t)import->reply.frame_count;
    return bytes <= import->job->most_bytes ||
           fail(import, "%lld frames of %lld vertices are more than %zu MiB",
                (long long)import->reply.frame_count, (long long)import->vertex_count,
                import->job->most_bytes >> 20);
}

static void read_metadata(Import *import) {
    const struct aiMetadata *data = import->scene->mMetaData;
    import->reply.up = -1;
    for (unsigned i = 0; data && i < data->mNumProperties; i++) {
        const struct aiMetadataEntry *entry = &data->mValues[i];
        const char *key = data->mKeys[i].data;
        if (strcmp(key, "UnitScaleFactor") == 0) { /* of FBX, in centimetres */
            double factor = entry->mType == AI_DOUBLE  ? *(double *)entry->mData
                            : entry->mType == AI_FLOAT ? *(float *)entry->mData
                                                       : 1.0;
            import->reply.unit = 0.01 * factor;
        } else if (strcmp(key, "UpAxis") == 0 && entry->mType == AI_INT32) {
            import->reply.up = *(int32_t *)entry->mData;
        }
    }
}

/* ---- files in memory ---- */

typedef struct Cursor {
    const MeshPart *part;
    size_t at;
} Cursor;

static size_t part_read(struct aiFile *file, char *to, size_t size, size_t count) {
    Cursor *cursor = (Cursor *)file->UserData;
    size_t left = size ? (cursor->part->size - cursor->at) / size : 0;
    count = count < left ? count : left;
    memcpy(to, cursor->part->bytes + cursor->at, size * count);
    cursor->at += size * count;
    return count;
}

static size_t part_write(struct aiFile *file, const char *from, size_t size, size_t count) {
    (void)file, (void)from, (void)size, (void)count;
    return 0;
}

static size_t part_tell(struct aiFile *file) { return ((Cursor *)file->UserData)->at; }
static size_t part_size(struct aiFile *file) { return ((Cursor *)file->UserData)->part->size; }
static void part_flush(struct aiFile *file) { (void)file; }

static enum aiReturn part_seek(struct aiFile *file, size_t offset, enum aiOrigin origin) {
    Cursor *cursor = (Cursor *)file->UserData;
    size_t base = origin == aiOrigin_CUR   ? cursor->at
                  : origin == aiOrigin_END ? cursor->part->size
                                           : 0;
    if (offset > cursor->part->size - base) {
        return aiReturn_FAILURE;
    }
    cursor->at = base + offset;
    return aiReturn_SUCCESS;
}

static struct aiFile *part_open(struct aiFileIO *io, const char *name, const char *mode) {
    const MeshJob *job = (const MeshJob *)io->UserData;
    const char *last = strrchr(name, '/');
    last = last ? last + 1 : name;
    for (int i = 0; i < job->part_count && mode[0] == 'r'; i++) {
        if (strcmp(job->parts[i].name, last) == 0) {
            struct aiFile *file = calloc(1, sizeof *file);
            Cursor *cursor = calloc(1, sizeof *cursor);
            if (!file || !cursor) {
                _exit(1);
            }
            cursor->part = &job->parts[i];
            *file = (struct aiFile){part_read, part_write, part_tell,         part_size,
                                    part_seek, part_flush, (aiUserData)cursor};
            return file;
        }
    }
    return NULL;
}

static void part_close(struct aiFileIO *io, struct aiFile *file) {
    (void)io;
    free(file->UserData);
    free(file);
}

static bool parse(Import *import) {
    struct aiFileIO io = {part_open, part_close, (aiUserData)import->job};
    import->scene = aiImportFileEx(
        import->job->parts[0].name,
        aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_ValidateDataStructure, &io);
    if (!import->scene) {
        return fail(import, "%.200s", aiGetErrorString());
    }
    read_metadata(import);
    if (import->job->animated) {
        if (import->scene->mNumAnimations == 0) {
            return fail(import, "there is no animation in it");
        }
        import->animation = import->scene->mAnimations[0];
    }
    return true;
}

void mesh_assimp_answer(const MeshJob *job, int out) {
    Import import = {.job = job, .out = out, .reply = {.magic = MESH_REPLY_MAGIC}};
    double ticks_per_second = 0.0;
    bool good =
        parse(&import) && list_instances(&import) && choose_frames(&import, &ticks_per_second);
    import.reply.vertex_count = import.vertex_count;
    import.reply.triangle_count = import.triangle_count;
    if (send_bytes(&import, &import.reply, sizeof import.reply) && good) {
        /* what does not arrive is missed by the reader */
        (void)(send_triangles(&import) && send_frames(&import, ticks_per_second));
    }
    /* the process ends here: nothing is given back */
}
