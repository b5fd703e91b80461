// test_report_colors.c: the colours of pages, read from the style sheet of a page, for every eye.
#include "report_check.h"
#include "test_color.h"

#define APART \
    14.0  // seven times what can just be told apart; Okabe's and Ito's own palette has 16 at least
#define OUTCOME 50.0  // of good and bad
#define READABLE 4.5  // contrast of text (WCAG AA)

static char* page(void) {
    OmReport r;
    om_report_begin(&r, "Colours", NULL);
    om_report_verdict(&r, "it is so", true);
    om_report_verdict(&r, "it is not so", false);
    return checked_page(&r);
}

// `--name:#rrggbb` behind `from`.
static void read_color(const char* from, const char* name, double color[3]) {
    char key[32];
    unsigned rgb;
    snprintf(key, sizeof key, "--%s:#", name);
    const char* at = strstr(from, key);
    assert_non_null(at);
    assert_int_equal(sscanf(at + strlen(key), "%6x", &rgb), 1);
    assert_true(strspn(at + strlen(key), "0123456789abcdef") == 6);
    for (int c = 0; c < 3; ++c) color[c] = color_linear((int)(rgb >> (16 - 8 * c) & 255));
}

static void check_theme(const char* css) {
    double series[OM_REPORT_MAX_SERIES][3], card[3], good[3], bad[3], ground[3];
    for (int i = 0; i < OM_REPORT_MAX_SERIES; ++i) {
        char name[8];
        snprintf(name, sizeof name, "c%d", i);
        read_color(css, name, series[i]);
    }
    read_color(css, "card", card);
    for (int eyes = 0; eyes < NSIGHT; ++eyes)
        for (int i = 0; i < OM_REPORT_MAX_SERIES; ++i) {
            assert_true(color_distance(series[i], card, eyes) > APART);
            for (int k = 0; k < i; ++k) {
                double d = color_distance(series[i], series[k], eyes);
                if (!(d > APART)) fail_msg("series %d and %d, eyes %d: %.1f", k, i, eyes, d);
            }
        }
    read_color(css, "good", good);
    read_color(css, "bad", bad);
    for (int eyes = 0; eyes < NSIGHT; ++eyes)
        assert_true(color_distance(good, bad, eyes) > OUTCOME);
    read_color(css, "good-bg", ground);
    assert_true(color_contrast(good, ground) > READABLE);
    read_color(css, "bad-bg", ground);
    assert_true(color_contrast(bad, ground) > READABLE);
    read_color(css, "ink", good);
    assert_true(color_contrast(good, card) > READABLE);
    read_color(css, "soft", good);
    assert_true(color_contrast(good, card) > READABLE);
}

static void test_both_themes(void** unused) {
    (void)unused;
    char* html = page();
    const char* dark = strstr(html, "prefers-color-scheme:dark");
    assert_non_null(dark);
    check_theme(strstr(html, ":root{"));
    check_theme(dark);
    om_free(html);
}

// An outcome has a sign and a word for readers of screens.
static void test_outcome_without_colour(void** unused) {
    (void)unused;
    char* html = page();
    assert_non_null(strstr(html, "aria-label=\"good\">&#10003;</span><span>it is so"));
    assert_non_null(strstr(html, "aria-label=\"not good\">&#10007;</span><span>it is not so"));
    om_free(html);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_both_themes),
                                       cmocka_unit_test(test_outcome_without_colour)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
