// cli_register.c: omentum register: where a frame of the robot is, from points that it touched.
#include <string.h>

#include "cli_common.h"
#include "omentum/dds.h"

static const OmCliOption option[] = {
    {"--frame", NULL, "NAME", "of the robot, as in headers of its messages: PSM1_base"},
    {"--output", "-o", "FILE", "file of frames, JSON; other frames that it has stay"},
    {"--limit", NULL, "MM", "largest residual of a point", "2", "mm", 1e-3, 1e3},
};

static const OmCliKey result_key[] = {
    {"points", "touched"},
    {"rms_mm", "of the residuals"},
    {"max_mm", "largest residual"},
    {"worst_line", "of the file, the point that has it"},
};

enum { MAX_POINT = 1000 };

typedef struct Points {
    int n;
    double frame[3 * MAX_POINT], world[3 * MAX_POINT];  // m
    int line[MAX_POINT];
} Points;

// Six numbers, with blanks or commas between them.
static OmStatus read_line(const char* path, int number, char* text, Points* p) {
    double x[6];
    int used = 0;
    for (char* c = text; *c; ++c)
        if (*c == ',' || *c == ';' || *c == '\r') *c = ' ';
    const int n =
        sscanf(text, "%lf %lf %lf %lf %lf %lf %n", &x[0], &x[1], &x[2], &x[3], &x[4], &x[5], &used);
    OM_CHECK(n == 6 && text[used] == 0, OM_INVALID,
             "%s:%d: not six numbers: x y z in the robot's frame, x y z in the world, mm", path,
             number);
    OM_CHECK(p->n < MAX_POINT, OM_INVALID, "%s: more than %d points", path, MAX_POINT);
    for (int i = 0; i < 3; ++i) {
        p->frame[3 * p->n + i] = 1e-3 * x[i];
        p->world[3 * p->n + i] = 1e-3 * x[3 + i];
    }
    p->line[p->n++] = number;
    return OM_OK;
}

static OmStatus read_points(const char* path, Points* p) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, 1000000, &text, &size));
    OmText copy = {0};  // with a zero at its end
    OmStatus status = om_text_append_raw(&copy, text, size);
    om_free(text);
    int number = 0;
    for (char* line = copy.str; status == OM_OK && line && *line;) {
        char* end = line + strcspn(line, "\n");
        const bool is_last = *end == 0;
        *end = 0;
        ++number;
        if (line[strspn(line, " \t\r")] != 0 && line[0] != '#')
            status = read_line(path, number, line, p);
        line = is_last ? end : end + 1;
    }
    om_text_done(&copy);
    return status;
}

// Put it among the frames of the file.
static OmStatus keep(const OmDdsFrame* made, const char* path) {
    OmDdsFrame frame[OM_DDS_MAX_FRAME];
    int n = 0, at = 0;
    if (om_path_exists(path)) OM_TRY(om_dds_frames_load(path, frame, &n));
    while (at < n && strcmp(frame[at].name, made->name) != 0) ++at;
    OM_CHECK(at < OM_DDS_MAX_FRAME, OM_INVALID, "%s has %d frames already", path, n);
    frame[at] = *made;
    return om_dds_frames_save(frame, at == n ? n + 1 : n, path);
}

static int om_cli_register(int argc, char** argv) {
    static Points points;
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmDdsFrame frame = {0};
    int npositional, worst;
    double limit_mm = 2;
    if (om_cli_check(&args, 1, &npositional) < 0) return om_cli_usage("register");
    const char* name = om_cli_get(&args, "--frame");
    const char* out = om_cli_get(&args, "--output");
    if (npositional != 1 || !name || !out || strlen(name) >= sizeof frame.name) {
        om_error(OM_INVALID, "a file of points, --frame and --output are needed");
        return om_cli_usage("register");
    }
    snprintf(frame.name, sizeof frame.name, "%s", name);
    const char* path = om_cli_positional(&args, 0);
    OmStatus status = om_cli_double(&args, "--limit", &limit_mm);
    if (status == OM_OK) status = read_points(path, &points);
    if (status == OM_OK) {
        status = om_dds_frame_fit(points.frame, points.world, points.n, &frame, &worst);
        if (status < 0) om_error_prefix(status, "%s", path);
    }
    if (status < 0) return om_cli_fail("register", status);
    const bool is_good = 1e3 * frame.max <= limit_mm;
    printf("%s: %d points, residuals %.2f mm (rms), at most %.2f mm (line %d)\n", name,
           frame.npoint, 1e3 * frame.rms, 1e3 * frame.max, points.line[worst]);
    om_cli_figure("points", frame.npoint);
    om_cli_figure("rms_mm", 1e3 * frame.rms);
    om_cli_figure("max_mm", 1e3 * frame.max);
    om_cli_figure("worst_line", points.line[worst]);
    if (!is_good) {
        printf("  above %g mm: nothing is written; touch the points again, first that of line %d\n",
               limit_mm, points.line[worst]);
        return OM_EXIT_FAILED;
    }
    status = keep(&frame, out);
    if (status < 0) return om_cli_fail("register", status);
    om_cli_path(out);
    return OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_register = {
    .name = "register",
    .run = om_cli_register,
    .summary = "find where a robot's frame is, from points that it touched",
    .usage = "omentum register POINTS.csv --frame NAME -o FRAMES.json [--limit MM]",
    .about =
        "Each line of POINTS.csv has six numbers in mm: a point as the robot measures it in the frame NAME when its\n"
        "tip touches it, and the same point in the world, the frame of the scene. Four points or more, not on one\n"
        "line; lines that begin with # are comments. The frame has the least squared residuals. If one is above\n"
        "--limit, nothing is written, and the exit code is 1. The file is for omentum retract --world dds --frames.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum register touched.csv --frame PSM1_base -o frames.json\n"
               "  omentum retract scenes/belief.yaml --world dds --frames frames.json -o out/robot",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
