// world_log_file.c: the file of a world's log.
//
//     "omentum world log 1\n"
//     kind size hash | payload     LOG_HEAD: arms, sources, kinematics
//     kind size hash | payload     a call with its answer, in the order of the calls
//     ...
//     kind 0    hash |             LOG_END
//
// kind and size are 32-bit numbers, hash is om_hash of kind, size and payload from the hash of the record before: no
// record can be changed, left out or moved. Numbers are in the order of bytes of this kind of processor; LOG_HEAD
// begins with a mark that shows another order. A file that ends within a record was cut off: the records before it are
// good. One function writes and reads each structure.
//
// Pictures are compressed by zlib at level 1: a colour picture as its difference from the camera's last one,
// depth as differences of neighbours in a row, its two bytes in planes of their own. Measured on 300 frames of
// scenes/belief.yaml (320 x 240, colour and noisy depth): 58 kB and 2.4 ms of processor time a frame. Rejected: colour
// as differences in a row and zlib's default strategy, 125 kB and 4.8 ms; the default strategy, 69 kB and 2.8 ms;
// Huffman codes alone, 90 kB and 3.1 ms.
//
// HDF5 (nn_store.h) was rejected: it keeps a file whole in memory until its end, and a file that HDF5 itself extends is
// not readable after a kill.
#include "world/world_log_file.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <zlib.h>

#define MAGIC "omentum world log 1\n"
#define ORDER 0x01020304u
#define MAX_RECORD (1u << 30)  // bytes
#define INFLATE_RATIO 1032     // deflate never expands further than this
#define MAX_TIME 1e12          // s

uint64_t om__log_hash(uint32_t kind, const void* data, size_t size, uint64_t before) {
    const uint32_t head[2] = {kind, (uint32_t)size};
    return om_hash(data, size, om_hash(head, sizeof head, before));
}

static OmStatus reserve(unsigned char** block, size_t* capacity, size_t size) {
    if (size <= *capacity) return OM_OK;
    om_free(*block);
    *capacity = 0;
    *block = om_alloc(size, 1);
    if (!*block) return OM_NO_MEMORY;
    *capacity = size;
    return OM_OK;
}

// ---- coding in both directions ------------------------------------------------------------------------------------

typedef struct Coder {
    LogWriter* writer;        // null: reads
    LogReader* reader;        // null: writes
    const unsigned char* at;  // reading: the rest of the record
    size_t left;
} Coder;

static OmStatus code(Coder* c, void* value, size_t size) {
    if (c->writer) return om_text_append_raw(&c->writer->record, value, size);
    OM_CHECK(size <= c->left, OM_INVALID, "the record is too short");
    memcpy(value, c->at, size);
    c->at += size;
    c->left -= size;
    return OM_OK;
}

static OmStatus code_int(Coder* c, int* value, int min, int max) {
    int32_t v = *value;
    OM_TRY(code(c, &v, sizeof v));
    OM_CHECK(v >= min && v <= max, OM_INVALID, "a whole number is %d; %d to %d", (int)v, min, max);
    *value = v;
    return OM_OK;
}

static OmStatus code_bool(Coder* c, bool* value) {
    int v = *value;
    OM_TRY(code_int(c, &v, 0, 1));
    *value = v;
    return OM_OK;
}

static OmStatus code_flags(Coder* c, unsigned* flags) {
    int v = (int)*flags;
    const unsigned known = OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH |
                           OM_OBSERVE_COLOR | OM_OBSERVE_WINDOW;
    OM_TRY(code_int(c, &v, 0, (int)known));
    *flags = (unsigned)v;
    return OM_OK;
}

// Numbers that must be finite.
static OmStatus code_numbers(Coder* c, double* value, int n) {
    OM_TRY(code(c, value, (size_t)n * sizeof *value));
    for (int i = 0; i < n; ++i) OM_CHECK(isfinite(value[i]), OM_INVALID, "a number is not finite");
    return OM_OK;
}

static OmStatus code_vector(Coder* c, OmVec3* v) {
    double x[3] = {v->x, v->y, v->z};
    OM_TRY(code_numbers(c, x, 3));
    *v = om_load3(x, 0);
    return OM_OK;
}

static OmStatus code_pose(Coder* c, OmPose* pose) {
    double q[4] = {pose->q.w, pose->q.x, pose->q.y, pose->q.z};
    OM_TRY(code_vector(c, &pose->p));
    OM_TRY(code_numbers(c, q, 4));
    pose->q = (OmQuat){.w = q[0], .x = q[1], .y = q[2], .z = q[3]};
    return OM_OK;
}

static OmStatus code_time(Coder* c, double* time) {
    OM_TRY(code_numbers(c, time, 1));
    OM_CHECK(fabs(*time) <= MAX_TIME, OM_INVALID, "a time is %g s", *time);
    return OM_OK;
}

// ---- pictures -------------------------------------------------------------------------------------------------------

// A count of depth; 0: no return. NaN is no return.
static unsigned count_of(float depth) {
    double count = (double)depth / OM_WORLD_LOG_UNIT + 0.5;
    return count >= 1 && count < 65536 ? (unsigned)count : 0;
}

static float depth_of(unsigned count) { return (float)(OM_WORLD_LOG_UNIT * count); }

void om__log_round(OmObservation* obs) {
    const OmCamera* camera = &obs->rgbd.camera;
    size_t n = obs->rgbd.depth ? (size_t)camera->width * (size_t)camera->height : 0;
    for (size_t i = 0; i < n; ++i) obs->rgbd.depth[i] = depth_of(count_of(obs->rgbd.depth[i]));
}

// Differences of counts along rows: low bytes, then high bytes.  (2 x width x height)
static void pack_depth(const float* depth, int width, int height, unsigned char* raw) {
    const size_t n = (size_t)width * (size_t)height;
    for (size_t i = 0; i < n; ++i) {
        unsigned before = i % (size_t)width ? count_of(depth[i - 1]) : 0;
        unsigned step = count_of(depth[i]) - before;
        raw[i] = (unsigned char)step;
        raw[n + i] = (unsigned char)(step >> 8);
    }
}

static void unpack_depth(const unsigned char* raw, int width, int height, float* depth) {
    const size_t n = (size_t)width * (size_t)height;
    unsigned count = 0;
    for (size_t i = 0; i < n; ++i) {
        unsigned step = raw[i] | (unsigned)raw[n + i] << 8;
        count = ((i % (size_t)width ? count : 0) + step) & 0xffffu;
        depth[i] = depth_of(count);
    }
}

// Where no picture of this size came before: differences of each channel along rows.
static unsigned predict(const OmPicture* p, const LogBefore* before, size_t n, size_t i) {
    const size_t row = (size_t)p->width * (size_t)p->nchannel, step = (size_t)p->nchannel;
    if (before->size == n) return before->pixel[i];
    return i % row >= step ? p->pixel[i - step] : 0;
}

static void pack_color(const OmPicture* p, const LogBefore* before, size_t n, unsigned char* raw) {
    for (size_t i = 0; i < n; ++i) raw[i] = (unsigned char)(p->pixel[i] - predict(p, before, n, i));
}

static void unpack_color(const unsigned char* raw, const LogBefore* before, size_t n,
                         OmPicture* p) {
    for (size_t i = 0; i < n; ++i) p->pixel[i] = (unsigned char)(raw[i] + predict(p, before, n, i));
}

static OmStatus keep_picture(LogBefore* before, const OmPicture* p, size_t n) {
    before->size = 0;
    OM_TRY(reserve(&before->pixel, &before->capacity, n));
    memcpy(before->pixel, p->pixel, n);
    before->size = n;
    return OM_OK;
}

// Room for `size` plain bytes, and behind them for the same bytes compressed.
static OmStatus reserve_raw(Coder* c, size_t size) {
    if (c->writer)
        return reserve(&c->writer->raw, &c->writer->raw_capacity, size + compressBound(size));
    return reserve(&c->reader->raw, &c->reader->raw_capacity, size);
}

static OmStatus write_raw(Coder* c, size_t size) {
    unsigned char* packed = c->writer->raw + size;
    const uLong most = compressBound(size);
    z_stream z = {.next_in = c->writer->raw,
                  .avail_in = (uInt)size,
                  .next_out = packed,
                  .avail_out = (uInt)most};
    OM_CHECK(deflateInit2(&z, 1, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_RLE) == Z_OK, OM_NO_MEMORY,
             "a picture cannot be compressed");
    const int status = deflate(&z, Z_FINISH);
    const uLong npacked = z.total_out;
    deflateEnd(&z);
    OM_CHECK(status == Z_STREAM_END, OM_IO, "a picture cannot be compressed");
    uint32_t stored = (uint32_t)npacked;
    OM_TRY(code(c, &stored, sizeof stored));
    return code(c, packed, npacked);
}

// Check that the record can hold `size` plain bytes before memory is allocated for them.
static OmStatus read_raw(Coder* c, size_t size, uint32_t* stored) {
    OM_TRY(code(c, stored, sizeof *stored));
    OM_CHECK(*stored <= c->left && size / INFLATE_RATIO <= *stored, OM_INVALID,
             "a picture of %zu bytes is cut off", size);
    OM_TRY(reserve_raw(c, size));
    uLongf n = size;
    bool is_good = uncompress(c->reader->raw, &n, c->at, *stored) == Z_OK && n == size;
    OM_CHECK(is_good, OM_INVALID, "a picture is damaged");
    c->at += *stored;
    c->left -= *stored;
    return OM_OK;
}

static OmStatus code_depth(Coder* c, OmDepthPicture* p) {
    bool has_depth = p->depth != NULL;
    uint32_t stored;
    OM_TRY(code_bool(c, &has_depth));
    if (!has_depth) return OM_OK;
    const size_t n = (size_t)p->camera.width * (size_t)p->camera.height;
    OM_CHECK(n > 0, OM_INVALID, "a depth picture has no camera");
    if (c->writer) {
        OM_TRY(reserve_raw(c, 2 * n));
        pack_depth(p->depth, p->camera.width, p->camera.height, c->writer->raw);
        return write_raw(c, 2 * n);
    }
    OM_TRY(read_raw(c, 2 * n, &stored));
    OM_ALLOC(p->depth, n);
    unpack_depth(c->reader->raw, p->camera.width, p->camera.height, p->depth);
    return OM_OK;
}

// A picture of the camera's size, or of its window.
static OmStatus code_color(Coder* c, int which, const OmCamera* camera, OmWindow window,
                           OmPicture* p) {
    int nchannel = p->pixel ? p->nchannel : 0;
    uint32_t stored;
    OM_TRY(code_int(c, &nchannel, 0, 4));
    if (nchannel == 0) return OM_OK;
    OM_CHECK(nchannel != 2 && camera->width > 0, OM_INVALID, "a picture of %d channels", nchannel);
    window = om_window_clip(window, camera->width, camera->height);
    OM_CHECK(window.width > 0, OM_INVALID, "the window of a picture lies outside of it");
    const size_t n = (size_t)window.width * (size_t)window.height * (size_t)nchannel;
    if (c->writer) {
        OM_CHECK(p->width == window.width && p->height == window.height, OM_INVALID,
                 "a picture of %d x %d pixels, its camera has %d x %d", p->width, p->height,
                 window.width, window.height);
        OM_TRY(reserve_raw(c, n));
        pack_color(p, &c->writer->before[which], n, c->writer->raw);
        OM_TRY(keep_picture(&c->writer->before[which], p, n));
        return write_raw(c, n);
    }
    OM_TRY(read_raw(c, n, &stored));
    OM_TRY(om_picture_init(p, window.width, window.height, nchannel));
    unpack_color(c->reader->raw, &c->reader->before[which], n, p);
    return keep_picture(&c->reader->before[which], p, n);
}

// ---- observations -----------------------------------------------------------------------------------------------

// A tool that is not measured has values that are not finite: they are stored as they come.
static OmStatus code_arm(Coder* c, OmArmObservation* arm) {
    OM_TRY(code(c, &arm->time, sizeof arm->time));
    OM_TRY(code(c, &arm->tip, sizeof arm->tip));
    OM_TRY(code(c, arm->q, sizeof arm->q));
    OM_TRY(code(c, &arm->jaw, sizeof arm->jaw));
    OM_TRY(code(c, &arm->jaw_speed, sizeof arm->jaw_speed));
    OM_TRY(code(c, &arm->jaw_goal, sizeof arm->jaw_goal));
    OM_TRY(code_bool(c, &arm->is_moving));
    OM_TRY(code_bool(c, &arm->has_wrench));
    OM_TRY(code(c, &arm->force, sizeof arm->force));
    return code(c, &arm->torque, sizeof arm->torque);
}

// Width 0: the observation has no camera.
static OmStatus code_camera(Coder* c, OmCamera* camera) {
    OM_TRY(code_int(c, &camera->width, 0, 8192));
    if (camera->width == 0) return OM_OK;
    OmLens* l = &camera->lens;
    double n[12] = {camera->fov, camera->near_m, camera->far_m, l->fx, l->fy, l->cx,
                    l->cy,       l->k1,          l->k2,         l->p1, l->p2, l->k3};
    OM_TRY(code_int(c, &camera->height, 1, 8192));
    OM_TRY(code_pose(c, &camera->pose_world_camera));
    OM_TRY(code_numbers(c, n, 12));
    camera->fov = n[0], camera->near_m = n[1], camera->far_m = n[2];
    *l = (OmLens){n[3], n[4], n[5], n[6], n[7], n[8], n[9], n[10], n[11]};
    return OM_OK;
}

// A camera is checked whole where it has a picture.
static OmStatus check_camera(const OmCamera* camera, bool has_picture) {
    return has_picture ? om_camera_check(camera) : OM_OK;
}

static OmStatus code_window(Coder* c, OmWindow* w) {
    OM_TRY(code_int(c, &w->column, 0, 8192));
    OM_TRY(code_int(c, &w->row, 0, 8192));
    OM_TRY(code_int(c, &w->width, 0, 8192));
    return code_int(c, &w->height, 0, 8192);
}

static OmStatus code_observation(Coder* c, unsigned what, OmObservation* obs) {
    OM_TRY(code_time(c, &obs->time));
    OM_TRY(code_int(c, &obs->narm, 0, OM_MAX_ARM));
    for (int a = 0; a < obs->narm; ++a) OM_TRY(code_arm(c, &obs->arm[a]));
    OM_TRY(code_numbers(c, &obs->visibility, 1));
    OM_TRY(code_time(c, &obs->endoscope.time));
    OM_TRY(code_camera(c, &obs->endoscope.camera));
    OM_TRY(check_camera(&obs->endoscope.camera, what & (OM_OBSERVE_IMAGE | OM_OBSERVE_WINDOW)));
    if (what & OM_OBSERVE_WINDOW) OM_TRY(code_window(c, &obs->endoscope.window));
    OM_TRY(code_color(c, 0, &obs->endoscope.camera, obs->endoscope.window, &obs->endoscope.color));
    OM_TRY(code_time(c, &obs->rgbd.time));
    OM_TRY(code_camera(c, &obs->rgbd.camera));
    OM_TRY(check_camera(&obs->rgbd.camera, what & (OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR)));
    OM_TRY(code_depth(c, &obs->rgbd));
    return code_color(c, 1, &obs->rgbd.camera, (OmWindow){0}, &obs->rgbd.color);
}

// ---- calls ----------------------------------------------------------------------------------------------------------

static OmStatus code_message(Coder* c, char* message, int size) {
    int len = (int)strlen(message);
    OM_TRY(code_int(c, &len, 0, size - 1));
    OM_TRY(code(c, message, (size_t)len));
    message[len] = '\0';
    OM_CHECK(om_text_is_plain(message, (size_t)len, "\n\t"), OM_INVALID,
             "a message holds control characters");
    return OM_OK;
}

static OmStatus code_call(Coder* c, int narm, LogCall* call) {
    int status = call->status;
    OM_TRY(code_int(c, &status, OM_CANCELLED, OM_TIMEOUT));
    call->status = (OmStatus)status;
    if (call->status < 0) OM_TRY(code_message(c, call->message, (int)sizeof call->message));
    bool has_arm = call->kind == LOG_MOVE || call->kind == LOG_JAW || call->kind == LOG_STOP;
    if (has_arm) OM_TRY(code_int(c, &call->arm, 0, narm - 1));
    if (call->kind == LOG_MOVE) OM_TRY(code_pose(c, &call->goal));
    if (call->kind == LOG_MOVE || call->kind == LOG_JAW || call->kind == LOG_ADVANCE)
        OM_TRY(code_numbers(c, &call->value, 1));
    if (call->kind != LOG_OBSERVE) return OM_OK;
    OM_TRY(code_flags(c, &call->what));
    return call->status < 0 ? OM_OK : code_observation(c, call->what, &call->observation);
}

// What only some instruments have.
static OmStatus code_rows(Coder* c, OmPsm* psm) {
    int has_jaw = psm->has_jaw, has_rows = psm->has_rows;
    OM_TRY(code_int(c, &psm->njoint, 4, OM_PSM_NJOINT));
    OM_TRY(code_int(c, &has_jaw, 0, 1));
    OM_TRY(code_int(c, &has_rows, 0, 1));
    psm->has_jaw = has_jaw, psm->has_rows = has_rows;
    for (int k = 0; k < 3; ++k) {
        double* const number[4] = {&psm->row[k].alpha, &psm->row[k].a, &psm->row[k].theta,
                                   &psm->row[k].d};
        for (int i = 0; i < 4; ++i) OM_TRY(code_numbers(c, number[i], 1));
    }
    return code_pose(c, &psm->pose_last_tip);
}

static OmStatus code_head(Coder* c, LogHead* head) {
    uint32_t order = ORDER;
    OM_TRY(code(c, &order, sizeof order));
    OM_CHECK(order == ORDER, OM_INVALID, "the log was written by another kind of processor");
    OM_TRY(code_int(c, &head->narm, 1, OM_MAX_ARM));
    OM_TRY(code_flags(c, &head->sources));
    for (int a = 0; a < head->narm; ++a) {
        OmPsm* psm = &head->psm[a];
        // 0: none, 1: an arm and a shaft of the default, 2: with their lengths, 3: with rows, or without a jaw
        const OmPsm usual = om_psm_default(OM_PROGRASP, om_pose_identity());
        const bool is_usual = psm->insertion == usual.insertion && psm->shaft == usual.shaft;
        const bool is_other = psm->has_rows || !psm->has_jaw;
        int form = !head->has_psm[a] ? 0 : is_other ? 3 : is_usual ? 1 : 2;
        OM_TRY(code_int(c, &form, 0, 3));
        head->has_psm[a] = form > 0;
        if (form == 0) continue;
        psm->njoint = form < 3 ? usual.njoint : psm->njoint;
        psm->has_jaw = form < 3 || psm->has_jaw;
        if (form < 3) psm->pose_last_tip = usual.pose_last_tip;
        if (form == 3) OM_TRY(code_rows(c, psm));
        if (form == 1) psm->insertion = usual.insertion, psm->shaft = usual.shaft;
        if (form >= 2) OM_TRY(code_numbers(c, &psm->insertion, 1));
        if (form >= 2) OM_TRY(code_numbers(c, &psm->shaft, 1));
        OM_TRY(code_pose(c, &psm->pose_world_rcm));
        OM_TRY(code_numbers(c, &psm->wrist, 1));
        OM_TRY(code_numbers(c, psm->q_min, OM_PSM_NJOINT));
        OM_TRY(code_numbers(c, psm->q_max, OM_PSM_NJOINT));
        OM_TRY(code_numbers(c, &psm->jaw_min, 1));
        OM_TRY(code_numbers(c, &psm->jaw_max, 1));
    }
    return OM_OK;
}

// ---- writing --------------------------------------------------------------------------------------------------------

static OmStatus write_failed(const LogWriter* w) {
    return om_error(OM_IO, "%s cannot be written: %s", w->path, strerror(errno));
}

// The record that was coded.
static OmStatus write_record(LogWriter* w, LogKind kind) {
    const size_t size = w->record.len;
    OM_CHECK(size <= MAX_RECORD, OM_INVALID, "%s: an observation of %zu bytes", w->path, size);
    LogRecordHead head = {(uint32_t)kind, (uint32_t)size, 0};
    head.hash = om__log_hash(head.kind, w->record.str, size, w->hash);
    errno = 0;
    bool is_good = fwrite(&head, sizeof head, 1, w->file) == 1 &&
                   (size == 0 || fwrite(w->record.str, size, 1, w->file) == 1) &&
                   fflush(w->file) == 0;
    if (!is_good) return write_failed(w);
    w->hash = head.hash;
    w->record.len = 0;
    return OM_OK;
}

OmStatus om__log_begin(const char* path, const LogHead* head, LogWriter* w) {
    LogHead copy = *head;
    Coder c = {.writer = w};
    OmStatus status = OM_OK;
    memset(w, 0, sizeof *w);
    w->hash = OM_HASH_SEED;
    OM_TRY(om_path_join(".", path, w->path, sizeof w->path));
    OM_CHECK(!om_path_exists(path), OM_IO, "%s exists already", path);
    OM_TRY_DONE(code_head(&c, &copy));
    errno = 0;
    w->file = fopen(path, "wb");
    if (!w->file || fwrite(MAGIC, sizeof MAGIC - 1, 1, w->file) != 1) OM_TRY_DONE(write_failed(w));
    OM_TRY_DONE(write_record(w, LOG_HEAD));
done:
    if (status < 0) om__log_writer_done(w);
    return status;
}

OmStatus om__log_write(LogWriter* w, const LogCall* call) {
    LogCall copy = *call;
    Coder c = {.writer = w};
    OM_CHECK(w->file, OM_INVALID, "%s: the log is closed", w->path);
    w->record.len = 0;
    OmStatus status = code_call(&c, OM_MAX_ARM, &copy);
    if (status < 0) return om_error_prefix(status, "%s", w->path);
    return write_record(w, call->kind);
}

OmStatus om__log_end(LogWriter* w) {
    if (!w->file) return OM_OK;
    w->record.len = 0;
    OmStatus status = write_record(w, LOG_END);
    if (fclose(w->file) != 0 && status == OM_OK) status = write_failed(w);
    w->file = NULL;
    return status;
}

void om__log_writer_done(LogWriter* w) {
    if (w->file) fclose(w->file);
    om_text_done(&w->record);
    om_free(w->raw);
    for (int k = 0; k < 2; ++k) om_free(w->before[k].pixel);
    memset(w, 0, sizeof *w);
}

// ---- reading --------------------------------------------------------------------------------------------------------

// The bytes of the next record. kind LOG_CUT: the file ends within it.
static OmStatus read_record(LogReader* r, LogKind* kind, size_t* size) {
    LogRecordHead head;
    *kind = LOG_CUT;
    *size = 0;
    if (r->left < sizeof head) return OM_OK;
    OM_CHECK(fread(&head, sizeof head, 1, r->file) == 1, OM_IO, "%s cannot be read", r->path);
    r->left -= sizeof head;
    OM_CHECK(head.kind < LOG_NKIND && head.size <= MAX_RECORD, OM_INVALID,
             "%s: record %d is damaged", r->path, r->nrecord);
    if (head.size > r->left) return OM_OK;
    OM_TRY(reserve(&r->record, &r->record_capacity, head.size));
    bool is_read = head.size == 0 || fread(r->record, head.size, 1, r->file) == 1;
    OM_CHECK(is_read, OM_IO, "%s cannot be read", r->path);
    r->left -= head.size;
    r->hash = om__log_hash(head.kind, r->record, head.size, r->hash);
    OM_CHECK(r->hash == head.hash, OM_INVALID, "%s: record %d is damaged", r->path, r->nrecord);
    *kind = (LogKind)head.kind;
    *size = head.size;
    ++r->nrecord;
    return OM_OK;
}

OmStatus om__log_open(const char* path, LogReader* r) {
    char magic[sizeof MAGIC - 1];
    LogKind kind;
    size_t size;
    OmStatus status = OM_OK;
    memset(r, 0, sizeof *r);
    r->hash = OM_HASH_SEED;
    OM_TRY(om_path_join(".", path, r->path, sizeof r->path));
    OM_TRY(om_file_open(path, &r->file, &r->size));
    r->left = r->size;
    bool is_log = r->left >= sizeof magic && fread(magic, sizeof magic, 1, r->file) == 1 &&
                  memcmp(magic, MAGIC, sizeof magic) == 0;
    OM_CHECK_DONE(is_log, OM_INVALID, "%s is not a log of a world of this version", path);
    r->left -= sizeof magic;
    OM_TRY_DONE(read_record(r, &kind, &size));
    OM_CHECK_DONE(kind == LOG_HEAD, OM_INVALID, "%s is cut off before its head ends", path);
    Coder c = {.reader = r, .at = r->record, .left = size};
    status = code_head(&c, &r->head);
    if (status == OM_OK && c.left > 0) status = om_error(OM_INVALID, "the head is too long");
    if (status < 0) om_error_prefix(status, "%s", path);
done:
    if (status < 0) om__log_close(r);
    return status;
}

OmStatus om__log_read(LogReader* r, LogCall* call) {
    size_t size;
    om_observation_done(&call->observation);
    memset(call, 0, sizeof *call);
    OM_TRY(read_record(r, &call->kind, &size));
    if (call->kind == LOG_CUT) return OM_OK;
    if (call->kind == LOG_END) {
        OM_CHECK(size == 0 && r->left == 0, OM_INVALID, "%s goes on behind its end", r->path);
        return OM_OK;
    }
    OM_CHECK(call->kind != LOG_HEAD, OM_INVALID, "%s has two heads", r->path);
    Coder c = {.reader = r, .at = r->record, .left = size};
    OmStatus status = code_call(&c, r->head.narm, call);
    if (status == OM_OK && c.left > 0) status = om_error(OM_INVALID, "it is too long");
    if (status < 0) {
        om_observation_done(&call->observation);
        return om_error_prefix(status, "%s: record %d", r->path, r->nrecord - 1);
    }
    return OM_OK;
}

void om__log_close(LogReader* r) {
    if (r->file) fclose(r->file);
    om_free(r->record);
    om_free(r->raw);
    for (int k = 0; k < 2; ++k) om_free(r->before[k].pixel);
    memset(r, 0, sizeof *r);
}
