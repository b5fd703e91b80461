// cli_study.c: omentum study: the thesis's experiments, one file each.
#include <stdio.h>
#include <string.h>

#include "cli_common.h"

static const struct {
    const char* name;
    int (*run)(int argc, char** argv);
    const char* about;
} study_table[] = {
    {"contact", om_cli_study_contact, "three ways to press a probe on a breast, measured"},
    {"calibration", om_cli_study_calibration, "particles calibrated on gel, tested on a breast"},
    {"sheet-calibration", om_cli_study_sheet,
     "particles calibrated on a sheet seen by a depth camera"},
    {"methods", om_cli_study_methods, "finite elements, particles and a network, compared"},
};
#define NSTUDY ((int)(sizeof study_table / sizeof *study_table))

static void print_help(void) {
    printf(
        "omentum study: the thesis's experiments\n\nUsage: omentum study NAME -o DIR [options]\n\n");
    for (int k = 0; k < NSTUDY; ++k)
        printf("  %-18s %s\n", study_table[k].name, study_table[k].about);
    printf("\n  omentum study NAME --help   options and examples of a study\n");
}

int om_cli_study(int argc, char** argv) {
    const char* name = argc > 1 ? argv[1] : "";
    for (int k = 0; k < NSTUDY; ++k)
        if (strcmp(name, study_table[k].name) == 0) return study_table[k].run(argc, argv);
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        print_help();
        return OM_EXIT_OK;
    }
    if (*name && *name != '-')
        fprintf(stderr, "omentum study: no study \"%s\"", name);
    else
        fprintf(stderr, "omentum study: no study is given");
    fprintf(stderr, "; there are contact, calibration, sheet-calibration and methods\n");
    return OM_EXIT_USAGE;
}
