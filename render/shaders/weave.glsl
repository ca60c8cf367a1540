// weave.glsl: threads that go over and under each other, at their real scale, fading into the
// mean colour where they are smaller than a sample.

const int WEAVE_PLAIN = 0, WEAVE_TWILL = 1, WEAVE_SATIN = 2, WEAVE_PILE = 3, WEAVE_DENIM = 4;

struct Weave {
    float over;    // 1: the warp thread (along u) is on top, 0: the weft thread
    vec2 tilt;     // slope of the thread's surface along u and v
    float crown;   // brightness across the thread
    float tint;    // brightness of this thread
    float lod;     // 0: threads are drawn, 1: only their mean
};

// One float: the visible stretch of a thread. Position -0.5..0.5 across and along it.
vec2 weave_float(int kind, ivec2 c, vec2 f, out bool warp_over) {
    int diagonal = (c.x + c.y) & 3;
    float steps = float(2 * c.x + c.y);
    float five = steps - 5.0 * floor((steps + 0.5) / 5.0); // an integer remainder would be slow
    float place;
    if (kind == WEAVE_PLAIN) {
        warp_over = ((c.x + c.y) & 1) == 0;
        place = warp_over ? f.x : f.y;
    } else if (kind == WEAVE_TWILL) {
        warp_over = diagonal < 2;
        float along = warp_over ? f.x : f.y;
        place = (float(diagonal & 1) + along + 0.5) * 0.5 - 0.5;
    } else if (kind == WEAVE_DENIM) { // 3/1 twill: warp floats over three
        warp_over = diagonal != 3;
        place = warp_over ? (float(diagonal) + f.x + 0.5) / 3.0 - 0.5 : f.y;
    } else {
        warp_over = five > 0.5;
        // along u the cell number goes 2, 4, 1, 3 through the float of four cells
        float cell = five == 2.0 ? 0.0 : (five == 4.0 ? 1.0 : (five == 1.0 ? 2.0 : 3.0));
        place = warp_over ? (cell + f.x + 0.5) * 0.25 - 0.5 : f.y;
    }
    return vec2(warp_over ? f.y : f.x, place);
}

const float TILT_ACROSS = 1.9, TILT_ALONG = 0.75; // slope of a thread at its rim, at its end
const float TINT_THREAD = 0.11, TINT_SLUB = 0.05; // spread of brightness
const float SLUB_LENGTH = 24.0;                   // [threads] of thick and thin places
const float LOD_BEGIN = 0.16, LOD_END = 0.60;     // [threads per sample]

// threads: across u (weft) and across v (warp), counted from the panel's corner.
// reach: how many threads a pattern's smallest visible feature spans.
Weave weave_at(int kind, vec2 threads, float threads_per_sample, float reach, bool back) {
    vec2 cell = floor(threads), f = threads - cell - 0.5;
    ivec2 c = ivec2(cell);
    bool warp_over;
    vec2 place = weave_float(kind, c, f, warp_over);
    warp_over = warp_over != back;
    Weave w;
    w.lod = kind == WEAVE_PILE ? 1.0 : smoothstep(LOD_BEGIN * reach, LOD_END * reach, threads_per_sample);
    w.over = warp_over ? 1.0 : 0.0;
    vec2 slope = vec2(place.x * TILT_ACROSS, place.y * TILT_ALONG);
    w.tilt = warp_over ? slope.yx : slope;
    w.crown = clamp(0.35 + 0.75 * (1.0 - 3.2 * (place.x * place.x + 0.25 * place.y * place.y)), 0.0, 1.0);
    int thread = warp_over ? c.y : c.x;
    float along = (warp_over ? threads.x : threads.y) / SLUB_LENGTH;
    float slub = noise_smooth(vec2(along, float(thread) * 7.0));
    w.tint = 1.0 + TINT_THREAD * noise_cell(ivec2(thread, warp_over ? 17 : 91)) + TINT_SLUB * slub;
    return w;
}

// Streaks along both thread directions whose width is about `width` [m].
float weave_streak_octave(vec2 metres, float width) {
    const float length_ratio = 22.0; // how long a streak is
    vec2 p = metres / width;
    float along_u = noise_smooth(vec2(p.x / length_ratio, p.y));
    float along_v = noise_smooth(vec2(p.x, p.y / length_ratio) + 400.0);
    return 0.5 * (along_u + along_v);
}

// Unevenness of yarn that stays visible from afar: streaks some samples wide, in octaves that
// fade into each other with the footprint, weaker the wider they are.
float weave_streaks(vec2 metres, float footprint) {
    const float finest = 0.0016, samples = 3.2, decay = 0.35; // [m]; [samples]; loss an octave
    float octave = max(log2(footprint * samples / finest), 0.0);
    float whole = floor(octave), part = octave - whole, width = finest * exp2(whole);
    float fine = weave_streak_octave(metres, width), wide = weave_streak_octave(metres, 2.0 * width);
    return mix(fine, wide, part) / (1.0 + decay * octave);
}
