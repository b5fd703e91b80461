// rl_trace.c: a recorded path of a tip becomes moves of a task.
//
// The tip of the plan stands on a grid of one move, which begins at the first row. In each step the path is followed to
// the point where it leaves the cube of one move to each side around the tip; the tip then goes to the place of the
// grid nearest to that point, at most half a move from it along each axis. So the moves follow corners of the path, and
// pauses cost no step. Where the jaw changes, the tip goes to that row, and one step changes the gripper.
//
// The task may not let the tip go everywhere (it stays 1 mm off kidney and table). Each action steers from the place of
// the tip to that of the plan, so that the tip returns to the plan; the deviation is measured at the tip.
#include <math.h>
#include <string.h>

#include "omentum/rl_trace.h"
#include "omentum/vec.h"
#include "rl/rl_internal.h"

enum { END_STEPS = 20 };

typedef struct Follower {
    const OmRlTrace* trace;
    OmRlDrive* drive;
    const OmRlTask* task;
    double move, max_deviation;
    int row;      // the path is followed up to the point `u` of the way from `row` to the next one
    double u;     //
    OmVec3 plan;  // the tip of the plan
    OmVec3 before;  // the tip before the step
    double deviation;
    bool is_closed;
} Follower;

static OmVec3 tip_of(const Follower* f) {
    double tip[3];
    f->task->ops->tip(f->task, om__rl_drive_state(f->drive), tip);
    return om_load3(tip, 0);
}

// The place of a row in its file, for messages.
typedef struct Place {
    char text[420];
} Place;

static Place place_of(const OmRlTrace* t, int row) {
    Place p;
    if (t->topic[0])
        snprintf(p.text, sizeof p.text, "%s: message %d of %s", t->name, t->line[row], t->topic);
    else
        snprintf(p.text, sizeof p.text, "%s:%d", t->name, t->line[row]);
    return p;
}

static bool is_closed_at(const OmRlTrace* t, int row) { return t->jaw[row] < OM_RL_JAW_CLOSED; }

static double segment_distance(OmVec3 a, OmVec3 b, OmVec3 p) {
    OmVec3 way = om_sub(b, a);
    double length2 = om_norm2(way);
    double s = length2 > 0 ? om_dot(om_sub(p, a), way) / length2 : 0;
    return om_distance(p, om_madd(a, fmin(1, fmax(0, s)), way));
}

// The parameter from u on at which the way from a to b leaves the cube around the plan; 2: it does not.
static double leave(const Follower* f, OmVec3 a, OmVec3 b) {
    double from[3], to[3], centre[3], first = 2;
    om_store3(from, 0, a);
    om_store3(to, 0, b);
    om_store3(centre, 0, f->plan);
    for (int k = 0; k < 3; ++k) {
        double way = to[k] - from[k];
        if (way == 0) continue;
        double s = (centre[k] + (way > 0 ? f->move : -f->move) - from[k]) / way;
        if (s >= f->u && s < first) first = s;
    }
    return first <= 1 ? first : 2;
}

// Follow the path to the end of the cube, to a row that changes the jaw, or to the last row. @return the point
static OmVec3 advance(Follower* f, bool* is_jaw) {
    const OmRlTrace* t = f->trace;
    *is_jaw = false;
    while (f->row + 1 < t->n) {
        OmVec3 a = om_load3(t->tip, f->row), b = om_load3(t->tip, f->row + 1);
        double s = leave(f, a, b);
        if (s <= 1) {
            f->u = s;
            return om_lerp(a, b, s);
        }
        ++f->row;
        f->u = 0;
        *is_jaw = f->task->has_jaw && is_closed_at(t, f->row) != f->is_closed;
        if (*is_jaw) return b;
    }
    return om_load3(t->tip, t->n - 1);
}

static OmStatus step(Follower* f) {
    int action[OM_RL_MAX_ACTION] = {0};
    double to[3];
    om_store3(to, 0, f->plan);
    f->before = tip_of(f);
    f->task->ops->steer(f->task, om__rl_drive_state(f->drive), to, f->is_closed, action);
    return om_rl_drive_step(f->drive, action);
}

// The distances of a point that was reached, and of the rows from `first` to the current one.
static OmStatus measure(Follower* f, int first, OmVec3 point) {
    const OmRlTrace* t = f->trace;
    OmVec3 now = tip_of(f);
    f->deviation = fmax(f->deviation, om_distance(now, point));
    for (int i = first; i <= f->row; ++i)
        f->deviation = fmax(f->deviation, segment_distance(f->before, now, om_load3(t->tip, i)));
    if (f->deviation <= f->max_deviation) return OM_OK;
    const bool is_coarse = f->deviation <= sqrt(3.0) * f->move;  // without an obstacle, too
    return om_error(
        OM_INVALID, "%s: the tip of task %s is %.2f mm from the path, at most %.2f mm: %s",
        place_of(t, f->row).text, f->task->name, 1e3 * f->deviation, 1e3 * f->max_deviation,
        is_coarse ? "moves of the task are long, and keep within sqrt(3) of their "
                    "length; make them shorter, or allow more (--deviation)"
                  : "an obstacle or the limit of a joint is in the way");
}

static double round_move(double way, double move) {
    return move * fmin(1, fmax(-1, floor(way / move + 0.5)));
}

static OmStatus follow_path(Follower* f) {
    const OmRlTrace* t = f->trace;
    const OmRlDriveNow* now = om_rl_drive_now(f->drive);
    bool is_jaw = f->task->has_jaw && is_closed_at(t, 0);
    while (!now->is_over) {
        int first = f->row + 1;
        bool is_first = is_jaw && now->nstep == 0;  // the jaw is closed from the beginning
        OmVec3 point = is_first ? f->plan : advance(f, &is_jaw);
        OmVec3 way = om_sub(point, f->plan);
        OmVec3 move = om_vec3(round_move(way.x, f->move), round_move(way.y, f->move),
                              round_move(way.z, f->move));
        bool is_end = f->row + 1 >= t->n;
        if (om_norm2(move) > 0) {
            f->plan = om_add(f->plan, move);
            OM_TRY(step(f));
            OM_TRY(measure(f, first, point));
            first = f->row + 1;
        }
        if (is_jaw && !now->is_over) {
            f->is_closed = !f->is_closed;
            OM_TRY(step(f));
            OM_TRY(measure(f, first, point));
            is_jaw = false;
        }
        if (is_end) break;
    }
    OM_CHECK(
        !now->is_over || now->is_terminated || f->row + 1 >= t->n, OM_INVALID,
        "%s: an episode of task %s has at most %d steps, and the path needs more; set max_step "
        "(-s max_step=N), or cut the table",
        place_of(t, f->row).text, f->task->name, f->task->max_step);
    for (int k = 0; k < END_STEPS && !now->is_over; ++k) OM_TRY(step(f));
    return OM_OK;
}

// Every row must be a place of the task. The message has the first one that is not, their number, and the last one: a
// recording often begins and ends beside the task.
static OmStatus check_rows(const OmRlTrace* t, const OmRlTask* task, OmRlDrive* drive) {
    char why[300] = "";
    int nout = 0, first = 0, last = 0;
    for (int i = t->n - 1; i >= 0; --i) {  // the first row is the last one to be placed
        OmStatus status = task->ops->place(task, om__rl_drive_state(drive), t->tip + 3 * (size_t)i);
        if (status < 0 && status != OM_INVALID)
            return om_error_prefix(status, "%s", place_of(t, i).text);
        if (status >= 0) continue;
        snprintf(why, sizeof why, "%s", om_error_message());
        last = nout == 0 ? i : last;
        first = i;
        ++nout;
    }
    if (nout == 0) return OM_OK;
    if (nout == 1) return om_error(OM_INVALID, "%s: %s", place_of(t, first).text, why);
    return om_error(OM_INVALID,
                    "%s: %s. So are %d of %d poses, the first at %.3f s and the last at %.3f s "
                    "after the begin",
                    place_of(t, first).text, why, nout, t->n, t->time[first] - t->time[0],
                    t->time[last] - t->time[0]);
}

OmStatus om_rl_trace_follow(const OmRlTrace* trace, double max_deviation, OmRlDrive* drive,
                            OmRlFollow* follow) {
    const OmRlTask* task = om__rl_drive_task(drive);
    double info[OM_RL_MAX_INFO] = {0};
    *follow = (OmRlFollow){0};
    OM_CHECK(task->ops->tip && task->ops->place && task->ops->steer && task->move > 0,
             OM_UNAVAILABLE, "task %s has no tip that follows a table of positions", task->name);
    OM_CHECK(max_deviation > 0, OM_INVALID, "the largest deviation is %g m; it must be above 0",
             max_deviation);
    OM_CHECK(trace->has_jaw || !task->has_jaw, OM_INVALID,
             "%s: the task has a gripper, and the table no column jaw (opening angle, rad)",
             trace->name);
    OM_TRY(om_rl_drive_reset(drive, -1));
    OM_TRY(check_rows(trace, task, drive));
    Follower f = {.trace = trace,
                  .drive = drive,
                  .task = task,
                  .move = task->move,
                  .max_deviation = max_deviation,
                  .plan = om_load3(trace->tip, 0)};
    f.deviation = om_distance(tip_of(&f), f.plan);
    OM_TRY(follow_path(&f));
    const OmRlDriveNow* now = om_rl_drive_now(drive);
    OM_TRY(om_rl_drive_info(drive, info, &follow->score));
    follow->deviation = f.deviation;
    follow->nstep = now->nstep;
    follow->is_terminated = now->is_terminated;
    return OM_OK;
}
