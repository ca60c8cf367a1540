#include "tests/support/contacts.h"

#include <math.h>

#include "tests/support/check.h"
#include "tests/support/play.h"

#define G 9.80665
#define MU 0.3

static void incline(Play *play, const char *solver, double tangent, double speed) {
    char text[2048];
    double a = atan(tangent);
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 20 cm, height: 20 cm}}\n    " CONTACTS_FABRIC
             "    nodes: 11 x 11\n    at: [0, 0, 0.99 mm]\n    velocity: [%.17g m/s, 0, 0]\n"
             "obstacles:\n  floor: {plane: {}, friction: 0.3}\n"
             "gravity: [%.17g, 0, %.17g]\n%s",
             speed, G * sin(a), -G * cos(a), solver);
    play_start(play, text);
}

void contacts_check_incline(const char *solver) {
    Play play;
    incline(&play, solver, 0.99 * MU, 0.0);
    play_to(&play, 0.5);
    double start = play_mean_x(&play).x;
    play_to(&play, 2.5);
    CHECK_AT_MOST(fabs(play_mean_x(&play).x - start), 1e-6);
    play_end(&play);
    for (int k = 0; k < 2; k++) {
        double tangent = MU * (k == 0 ? 1.01 : 1.05), a = atan(tangent);
        incline(&play, solver, tangent, 0.0);
        play_to(&play, 0.5);
        double v = play_mean_v(&play).x;
        play_to(&play, 2.5);
        double acceleration = (play_mean_v(&play).x - v) / 2.0;
        CHECK_AT_MOST(fabs(acceleration - G * (sin(a) - MU * cos(a))), 5e-4);
        play_end(&play);
    }
}

void contacts_check_stop(const char *solver) {
    Play play;
    incline(&play, solver, 0.0, 1.0);
    play_to(&play, 1.0);
    CHECK_NEAR(play_mean_x(&play).x, 1.0 / (2.0 * MU * G), 0.005 * 0.17);
    CHECK_AT_MOST(vec3_length(play_mean_v(&play)), 1e-6);
    play_end(&play);
}

const char *const contacts_solids[CONTACTS_SOLIDS] = {
    "box: {size: [20 cm, 20 cm, 20 cm]}, at: [1.3 cm, 0.7 cm, -10 cm]",
    "box: {size: [20 cm, 20 cm, 20 cm]}, at: [0, 0, -14.2 cm], turn: {axis: x, by: 45 deg}",
    "sphere: {radius: 6 cm}, at: [0.4 cm, 0.3 cm, -6 cm]",
    "cylinder: {radius: 2 cm, from: [-30 cm, 0.3 cm, -2 cm], to: [30 cm, 0, -2 cm]}",
    "cone: {radius: 8 cm, length: 20 cm}, at: [0.3 cm, 0.2 cm, -10 cm]",
    "capsule: {radius: 1 cm, from: [0, 0, -20 cm], to: [0.4 cm, 0, -1 cm]}",
    "plane: {}, at: [0, 0, -1 cm]",
};
