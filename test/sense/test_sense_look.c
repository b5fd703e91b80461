// test_sense_look.c: parts of a picture differ in colour for every eye.
#include "test_color.h"
#include "test_common.h"

#include "omentum/sense.h"

// Ten times what can just be told apart; shades vary by lighting. The former magenta on the former board had 14.
#define APART 30.0

// The surroundings of the region of interest and the attachments are clearly visible.
static void test_parts_differ(void** unused) {
    (void)unused;
    for (int which = OM_PART_ROI; which <= OM_PART_HELD; ++which) {
        const OmSenseLook a = om_sense_look(which);
        const double ca[3] = {a.red, a.green, a.blue};
        for (int other = 0; other < OM_NPART; ++other) {
            const OmSenseLook b = om_sense_look(other);
            const double cb[3] = {b.red, b.green, b.blue};
            if (other == which) continue;
            // attachments are marked in pictures of models, which have no tools with shafts
            if (which == OM_PART_HELD && other == OM_PART_SHAFT) continue;
            for (int eyes = 0; eyes < NSIGHT; ++eyes) {
                double d = color_distance(ca, cb, eyes);
                if (!(d > APART)) fail_msg("parts %d and %d, eyes %d: %.1f", which, other, eyes, d);
            }
        }
    }
}

// The measure itself: black and white are 100 apart; red and green of one lightness are one for a deuteranope.
static void test_measure(void** unused) {
    (void)unused;
    const double black[3] = {0, 0, 0}, white[3] = {1, 1, 1};
    const double red[3] = {0.35, 0.02, 0.02}, green[3] = {0.02, 0.118, 0.02};
    assert_near(color_distance(black, white, NORMAL), 100, 0.1);
    assert_near(color_contrast(black, white), 21, 1e-9);
    assert_true(color_distance(red, green, NORMAL) > 60);
    assert_true(color_distance(red, green, DEUTERANOPIA) <
                0.5 * color_distance(red, green, NORMAL));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_measure),
                                       cmocka_unit_test(test_parts_differ)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
