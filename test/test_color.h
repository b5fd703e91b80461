// test_color.h: how far apart two colours are, for ordinary and for colour-blind eyes.
//
// Colours are linear RGB. Dichromats see them through the matrices of Machado, Oliveira and Fernandes (2009) for
// severity 1; the distance is CIE 1976 in L*a*b* under D65. 2 can just be told apart side by side.
#ifndef OMENTUM_TEST_COLOR_H
#define OMENTUM_TEST_COLOR_H

#include <math.h>

enum { NORMAL, DEUTERANOPIA, PROTANOPIA, TRITANOPIA, NSIGHT };

static const double sight[NSIGHT][3][3] = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                           {{0.367322, 0.860646, -0.227968},
                                            {0.280085, 0.672501, 0.047413},
                                            {-0.011820, 0.042940, 0.968881}},
                                           {{0.152286, 1.052583, -0.204868},
                                            {0.114503, 0.786281, 0.099216},
                                            {-0.003882, -0.048116, 1.051998}},
                                           {{1.255528, -0.076749, -0.178779},
                                            {-0.078411, 0.930809, 0.147602},
                                            {0.004733, 0.691367, 0.303900}}};

static inline double color_linear(int byte) {
    double c = byte / 255.0;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static inline double color_luminance(const double c[3]) {
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

static inline void color_lab(const double rgb[3], int eyes, double lab[3]) {
    double c[3], f[3];
    for (int i = 0; i < 3; ++i) {
        c[i] = 0;
        for (int j = 0; j < 3; ++j) c[i] += sight[eyes][i][j] * rgb[j];
        c[i] = fmin(1, fmax(0, c[i]));
    }
    const double xyz[3] = {(0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2]) / 0.9505,
                           color_luminance(c),
                           (0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]) / 1.089};
    for (int i = 0; i < 3; ++i)
        f[i] = xyz[i] > 0.008856 ? cbrt(xyz[i]) : 7.787 * xyz[i] + 16.0 / 116;
    lab[0] = 116 * f[1] - 16, lab[1] = 500 * (f[0] - f[1]), lab[2] = 200 * (f[1] - f[2]);
}

static inline double color_distance(const double a[3], const double b[3], int eyes) {
    double p[3], q[3];
    color_lab(a, eyes, p);
    color_lab(b, eyes, q);
    return sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                (p[2] - q[2]) * (p[2] - q[2]));
}

// Of text on a ground, 1 to 21 (WCAG): 4.5 is what small text needs.
static inline double color_contrast(const double a[3], const double b[3]) {
    double p = color_luminance(a) + 0.05, q = color_luminance(b) + 0.05;
    return p > q ? p / q : q / p;
}

#endif
