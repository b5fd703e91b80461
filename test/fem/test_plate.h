// test_plate.h: exact deflection of a square plate.
#ifndef OMENTUM_TEST_PLATE_H
#define OMENTUM_TEST_PLATE_H

#include <math.h>
#include <stdbool.h>

#include "omentum/vec.h"

typedef struct Plate {  // square, hard supported, under pressure
    double side, thickness, young, poisson, pressure;
} Plate;

// Deflection of its middle: Navier's series for Kirchhoff's plate, and what shear adds in Mindlin's: the same series
// over k G t (Marcus's theorem for hard supports).
static inline double plate_deflection(const Plate* p, bool has_shear) {
    const double D = p->young * pow(p->thickness, 3) / (12 * (1 - p->poisson * p->poisson)),
                 shear = 5.0 / 6 * p->young / (2 * (1 + p->poisson)) * p->thickness;
    double w = 0;
    for (int m = 1; m < 80; m += 2)
        for (int n = 1; n < 80; n += 2) {
            const double sign = (m + n) % 4 == 2 ? 1 : -1,
                         s = OM_PI * OM_PI * (m * m + n * n) / (p->side * p->side),
                         q = 16 * p->pressure / (OM_PI * OM_PI * m * n);
            w += sign * q * (1 / (D * s * s) + (has_shear ? 1 / (shear * s) : 0));
        }
    return w;
}

#endif
