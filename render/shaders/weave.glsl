// weave.glsl: threads that go over and under each other, at their real scale, fading into the
// mean colour where they are smaller than a sample. WEAVE says which; see WeaveKind in look.h.
#define WEAVE_PLAIN 0
#define WEAVE_TWILL 1
#define WEAVE_SATIN 2
#define WEAVE_PILE 3
#define WEAVE_DENIM 4
#define WEAVE_PANAMA 5
#define WEAVE_KNIT 6
#ifdef WEAVE

struct Weave {
    float over;    // 1: the warp thread (along u) is on top, 0: the weft thread
    vec2 tilt;     // slope of the thread's surface along u and v
    float crown;   // brightness across the thread
    float tint;    // brightness of this thread
    float lod;     // 0: threads are drawn, 1: only their mean
};

// One float: the visible stretch of a thread. Position -0.5..0.5 across and along it.
vec2 weave_float(ivec2 c, vec2 f, out bool warp_over) {
    float place;
#if WEAVE == WEAVE_TWILL
    int diagonal = (c.x + c.y) & 3;
    warp_over = diagonal < 2;
    float along = warp_over ? f.x : f.y;
    place = (float(diagonal & 1) + along + 0.5) * 0.5 - 0.5;
#elif WEAVE == WEAVE_DENIM // 3/1 twill: warp floats over three
    int diagonal = (c.x + c.y) & 3;
    warp_over = diagonal != 3;
    place = warp_over ? (float(diagonal) + f.x + 0.5) / 3.0 - 0.5 : f.y;
#elif WEAVE == WEAVE_SATIN
    float steps = float(2 * c.x + c.y);
    float five = steps - 5.0 * floor((steps + 0.5) / 5.0); // an integer remainder would be slow
    warp_over = five > 0.5;
    // along u the cell number goes 2, 4, 1, 3 through the float of four cells
    float cell = five == 2.0 ? 0.0 : (five == 4.0 ? 1.0 : (five == 1.0 ? 2.0 : 3.0));
    place = warp_over ? (cell + f.x + 0.5) * 0.25 - 0.5 : f.y;
#elif WEAVE == WEAVE_PANAMA // pairs of threads over pairs
    warp_over = ((c.x >> 1) + (c.y >> 1) & 1) == 0;
    place = warp_over ? (float(c.x & 1) + f.x + 0.5) * 0.5 - 0.5 : (float(c.y & 1) + f.y + 0.5) * 0.5 - 0.5;
#else
    warp_over = ((c.x + c.y) & 1) == 0;
    place = warp_over ? f.x : f.y;
#endif
    return vec2(warp_over ? f.y : f.x, place);
}

const float TILT_ACROSS = 1.9, TILT_ALONG = 0.75; // slope of a thread at its rim, at its end
const float TINT_THREAD = 0.11, TINT_SLUB = 0.05; // spread of brightness
const float SLUB_LENGTH = 24.0;                   // [threads] of thick and thin places
const float LOD_BEGIN = 0.16, LOD_END = 0.60;     // [threads per sample]

// threads: across u (weft) and across v (warp), counted from the panel's corner.
Weave weave_threads(vec2 threads, bool back) {
    vec2 cell = floor(threads), f = threads - cell - 0.5;
    ivec2 c = ivec2(cell);
    bool warp_over;
    vec2 place = weave_float(c, f, warp_over);
    warp_over = warp_over != back;
    Weave w;
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

// Plain jersey. Loops lie in wales along u (one a unit of threads.y) and courses across them. The
// face shows the two legs of each loop as a V, the back the heads and feet as rows of waves. Each is
// a round piece of yarn that reaches into the next course; the higher one is seen.
const float KNIT_LEG = 0.26, KNIT_LEAN = 0.24;  // of a wale: half the gap of the legs, their lean
const vec2 KNIT_LEG_SIZE = vec2(0.88, 0.31);    // half length in courses, half width in wales
const float KNIT_WAVE = 0.34, KNIT_THICK = 0.52; // of a course: height of the waves, half their yarn
const float KNIT_RELIEF = 0.55;

// Height 0..1 of a leg and its gradient along (u, v); along: courses from its middle.
vec3 knit_leg(float along, float wale) {
    float side = wale >= 0.0 ? 1.0 : -1.0;
    vec2 at = vec2(along, abs(wale) - KNIT_LEG - KNIT_LEAN * along) / KNIT_LEG_SIZE;
    vec2 slope = at / KNIT_LEG_SIZE;
    return vec3(1.0 - dot(at, at), -2.0 * vec2(slope.x - KNIT_LEAN * slope.y, slope.y * side));
}

vec3 knit_wave(float along, float wale) {
    float at = (along - KNIT_WAVE * cos(TAU * wale)) / KNIT_THICK;
    return vec3(1.0 - at * at, -2.0 * at / KNIT_THICK * vec2(1.0, KNIT_WAVE * TAU * sin(TAU * wale)));
}

Weave weave_knit(vec2 loops, bool back) {
    vec2 cell = floor(loops), f = loops - cell - 0.5;
    float next = f.x >= 0.0 ? 1.0 : -1.0; // the nearer neighbour course
    vec3 here = back ? knit_wave(f.x, f.y) : knit_leg(f.x, f.y);
    vec3 there = back ? knit_wave(f.x - next, f.y) : knit_leg(f.x - next, f.y);
    vec3 seen = here.x >= there.x ? here : there;
    float course = here.x >= there.x ? cell.x : cell.x + next;
    float height = max(seen.x, 0.0);
    Weave w;
    w.over = 1.0;
    w.tilt = -KNIT_RELIEF * seen.yz / (1.0 + 0.5 * length(seen.yz));
    w.crown = clamp(0.22 + 0.95 * height, 0.0, 1.0);
    float fibre = noise_smooth(vec2(loops.x * 2.0, loops.y * 9.0));
    w.tint = 1.0 + 0.6 * TINT_THREAD * noise_cell(ivec2(course, 17)) + 0.06 * fibre;
    return w;
}

// Fibres that stand up or lie matted: no direction, only an uneven height.
Weave weave_pile(vec2 threads) {
    const float finer = 1.7;
    vec2 p = threads * finer;
    float here = noise_smooth(p) + 0.6 * noise_smooth(p.yx * 2.3 + 31.0);
    float along_u = noise_smooth(p + vec2(0.35, 0.0)) + 0.6 * noise_smooth(p.yx * 2.3 + vec2(31.0, 31.8));
    float along_v = noise_smooth(p + vec2(0.0, 0.35)) + 0.6 * noise_smooth(p.yx * 2.3 + vec2(31.8, 31.0));
    Weave w;
    w.over = 1.0;
    w.tilt = vec2(here - along_u, here - along_v) * 1.6;
    w.crown = clamp(0.83 + 0.45 * here, 0.0, 1.0);
    w.tint = 1.0;
    return w;
}

// reach: how many threads a pattern's smallest visible feature spans.
Weave weave_at(vec2 threads, float threads_per_sample, float reach, bool back) {
#if WEAVE == WEAVE_KNIT
    Weave w = weave_knit(threads, back);
#elif WEAVE == WEAVE_PILE
    Weave w = weave_pile(threads);
#else
    Weave w = weave_threads(threads, back);
#endif
    w.lod = smoothstep(LOD_BEGIN * reach, LOD_END * reach, threads_per_sample);
    return w;
}

// The part of the stretch x +- width / 2 that lies in bands which begin and end at these parts of
// a repeat: exact, so that narrow stripes far away fade and do not flicker.
float weave_bands(float x, float width, float repeat, vec2 band) {
    float wide = band.y - band.x, span = max(width, 1e-6) / repeat;
    vec2 ends = x / repeat + vec2(0.5, -0.5) * span, whole = floor(ends);
    vec2 covered = whole * wide + clamp(ends - whole - band.x, 0.0, wide);
    return clamp((covered.x - covered.y) / span, 0.0, 1.0);
}

// Streaks along both thread directions whose width is about `width` [m].
float weave_streak_octave(vec2 metres, float width) {
    const float length_ratio = 22.0; // how long a streak is
    vec2 p = metres / width;
#if WEAVE == WEAVE_PILE // no yarn: clouds instead of streaks
    return 0.6 * noise_smooth(p * 0.5) + 0.4 * noise_smooth(p.yx * 0.23 + 400.0);
#endif
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
#endif
