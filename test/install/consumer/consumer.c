// consumer.c: a user's first program: random points, their mean, a file that appears whole.
#include <math.h>
#include <stdio.h>

#include "omentum/omentum.h"

int main(void) {
    OmRng rng = om_rng_init(1, 0);
    double sum = 0;
    for (int i = 0; i < 1000; i++) sum += om_rng_uniform(&rng);
    OmText text = {0};
    OmStatus status = om_text_append(&text, "mean %.6f\n", sum / 1000);
    if (status == OM_OK) status = om_file_write("mean.txt", text.str, text.len);
    om_text_done(&text);
    if (status != OM_OK) {
        fprintf(stderr, "%s\n", om_error_message());
        return 1;
    }
    printf("omentum: mean of 1000 uniform numbers %.3f\n", sum / 1000);
    return fabs(sum / 1000 - 0.5) < 0.05 ? 0 : 1;
}
