// cli_umesh.c: omentum umesh: learned deformation; a subcommand a step.
#include <stdio.h>
#include <string.h>

#include "cli_common.h"

static const struct {
    const char* name;
    int (*run)(int argc, char** argv);
    const char* about;
} step_table[] = {
    {"generate", om_cli_umesh_generate, "make samples of how an organ deforms, by finite elements"},
    {"train", om_cli_umesh_train, "let a network learn from them"},
    {"predict", om_cli_umesh_predict, "press on the organ and see where all of it goes"},
    {"eval", om_cli_umesh_eval, "hold predictions against samples that training has not seen"},
};
#define NSTEP ((int)(sizeof step_table / sizeof *step_table))

static void print_help(void) {
    printf("omentum umesh: a network that knows how an organ deforms\n\n"
           "Usage: omentum umesh STEP [options]\n\n");
    for (int k = 0; k < NSTEP; ++k) printf("  %-10s %s\n", step_table[k].name, step_table[k].about);
    printf("\n  omentum umesh STEP --help   options and examples of a step\n");
}

int om_cli_umesh(int argc, char** argv) {
    const char* name = argc > 1 ? argv[1] : "";
    const char* names[NSTEP];
    for (int k = 0; k < NSTEP; ++k) {
        names[k] = step_table[k].name;
        if (strcmp(name, names[k]) == 0) return step_table[k].run(argc - 1, argv + 1);
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        print_help();
        return OM_EXIT_OK;
    }
    const char* nearest = om_nearest_word(name, names, NSTEP);
    if (*name && *name != '-')
        fprintf(stderr,
                "omentum umesh: unknown step \"%s\"%s%s%s; omentum umesh --help lists them\n", name,
                nearest ? "; did you mean \"" : "", nearest ? nearest : "", nearest ? "\"?" : "");
    else
        fprintf(stderr, "omentum umesh: no step is given; omentum umesh --help lists them\n");
    return OM_EXIT_USAGE;
}
