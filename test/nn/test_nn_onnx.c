// test_nn_onnx.c: ONNX files: their bytes against a small reader of our own, their outputs against onnxruntime's
// where python3 (or OM_PYTHON) has it.
#include "omentum/nn_file.h"
#include "test_alloc.h"
#include "test_files.h"

#include <sys/wait.h>

// ---- networks: every kind of layer ------------------------------------------------------------------------

static const int two[3] = {2, 2, 2}, three[3] = {3, 3, 3}, one[3] = {1, 1, 1};

static OmNet* dense_net(void) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){2, 2, 3, 2});
    x = om_net_add_dense(net, "first", x, 7);
    x = om_net_add_activation(net, x, OM_TANH, 0);
    x = om_net_add_dropout(net, x, 0.5F);
    x = om_net_add_dense(net, "second", x, 3);
    assert_ok(om_net_finish(net, om_net_add_activation(net, x, OM_SIGMOID, 0)));
    return net;
}

static OmNet* window_net(void) {
    OmNet* net;
    OmNetConv conv = {5, {3, 1, 5}, {2, 1, 1}, {1, 0, 2}, true},
              up = {4, {2, 3, 2}, {2, 1, 1}, {0, 1, 0}, false};
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){3, 8, 6, 7});
    x = om_net_add_conv(net, "conv", x, conv);
    x = om_net_add_activation(net, x, OM_LEAKY_RELU, 0.1F);
    x = om_net_add_max_pool(net, x, three, two, one);
    x = om_net_add_conv_up(net, "up", x, up);
    assert_ok(om_net_finish(net, x));
    return net;
}

static OmNet* norm_net(void) {
    OmNet* net;
    const int scale[3] = {2, 3, 1};
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){2, 3, 2, 4});
    int a = om_net_add_conv(net, "a", x, om_net_conv(6, 3));
    int b = om_net_add_group_norm(net, "groups", a, 3);
    int c = om_net_add_batch_norm(net, "batch", a);
    x = om_net_add_concat(net, 3, (int[]){b, c, x});
    x = om_net_add_upsample(net, x, scale);
    assert_ok(om_net_finish(net, om_net_add_dropout(net, x, 0.5F)));
    return net;
}

static OmNet* u_net(void) {
    OmNet* net;
    float mask[8 * 4 * 12];
    OmUnetDef def = om_unet_default_def((OmNetShape){3, 8, 4, 12}, 3);
    for (int i = 0; i < 8 * 4 * 12; ++i) mask[i] = i % 3 > 0;
    def.nlevel = 3;  // at the last one height and width are odd, and stay
    def.base_channels = 4;
    def.norm = OM_LAYER_GROUP_NORM;
    def.ngroup = 4;
    def.mask = mask;
    assert_ok(om_unet_create(&def, &net));
    return net;
}

static OmNet* (*const build[])(void) = {dense_net, window_net, norm_net, u_net};
enum { NNET = sizeof build / sizeof *build };

// Parameters that hide nothing: biases, norms and statistics away from 0 and 1; variances positive.
static float* make_parameters(const OmNet* net) {
    size_t n = om_net_parameter_size(net);
    float* param = om_alloc(n, sizeof *param);
    assert_non_null(param);
    om_net_init_parameters(net, 5, param);
    OmRng rng = om_rng_init(6, 0);
    for (size_t i = 0; i < n; ++i) param[i] += (float)om_rng_range(&rng, 0, 0.2);
    return param;
}

// ---- a reader of Protocol Buffers -------------------------------------------------------------------------

typedef struct Field {
    int number, type;
    uint64_t value;             // varint
    const unsigned char* data;  // bytes or word
    size_t size;
} Field;

typedef struct Reader {
    const unsigned char *at, *end;
} Reader;

static uint64_t read_varint(Reader* r) {
    uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
        assert_true(r->at < r->end && shift < 64);
        unsigned char byte = *r->at++;
        value |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80) return value;
    }
}

static bool next(Reader* r, Field* f) {
    if (r->at == r->end) return false;
    uint64_t key = read_varint(r);
    *f = (Field){.number = (int)(key >> 3), .type = (int)(key & 7), .data = r->at};
    if (f->type == 0) {
        f->value = read_varint(r);
        return true;
    }
    assert_true(f->type == 2 || f->type == 5);
    f->size = f->type == 5 ? 4 : (size_t)read_varint(r);
    f->data = r->at;
    assert_true(f->size <= (size_t)(r->end - r->at));
    r->at += f->size;
    return true;
}

static Reader inside(const Field* f) {
    assert_int_equal(f->type, 2);
    return (Reader){f->data, f->data + f->size};
}

typedef struct Names {  // of values that exist
    char name[256][80];
    int count;
} Names;

static void add_name(Names* names, const Field* f) {
    assert_true(names->count < 256 && f->size < 80);
    snprintf(names->name[names->count++], 80, "%.*s", (int)f->size, (const char*)f->data);
}

static bool has_name(const Names* names, const Field* f) {
    for (int i = 0; i < names->count; ++i)
        if (strlen(names->name[i]) == f->size && memcmp(names->name[i], f->data, f->size) == 0)
            return true;
    return false;
}

// A tensor's raw data have the size its shape says; its name is new.
static void check_tensor(Reader r, Names* names) {
    uint64_t count = 1, size = 0, bytes = 0;
    for (Field f; next(&r, &f);) {
        if (f.number == 1) count *= f.value;
        if (f.number == 2) size = f.value == 1 ? 4 : 8;
        if (f.number == 9) bytes = f.size;
        if (f.number == 8) {
            assert_false(has_name(names, &f));
            add_name(names, &f);
        }
    }
    assert_true(size > 0);
    assert_int_equal(count * size, bytes);
}

// Nodes read what exists before them, and write names of their own.
static void check_node(Reader r, Names* names, char* op) {
    Field output = {0};
    for (Field f; next(&r, &f);) {
        if (f.number == 1 && f.size > 0 && !has_name(names, &f))
            fail_msg("a node reads \"%.*s\", which nothing wrote", (int)f.size,
                     (const char*)f.data);
        if (f.number == 2) output = f;
        if (f.number == 4) snprintf(op, 40, "%.*s", (int)f.size, (const char*)f.data);
    }
    assert_false(has_name(names, &output));
    add_name(names, &output);
}

static int check_graph(Reader graph, char ops[][40]) {
    Names names = {0};
    int nnode = 0;
    Reader r = graph;
    for (Field f; next(&r, &f);)
        if (f.number == 5) check_tensor(inside(&f), &names);
    r = graph;
    for (Field f; next(&r, &f);) {
        if (f.number != 11 && f.number != 12) continue;
        Reader info = inside(&f);
        Field name;
        assert_true(next(&info, &name) && name.number == 1);
        if (f.number == 11) add_name(&names, &name);
        assert_memory_equal(name.data, f.number == 11 ? "input" : "output", name.size);
    }
    r = graph;
    for (Field f; next(&r, &f);)
        if (f.number == 1) check_node(inside(&f), &names, ops[nnode++]);
    Field output = {.data = (const unsigned char*)"output", .size = 6};
    assert_true(has_name(&names, &output));
    return nnode;
}

static int walk(const char* path, char ops[][40]) {
    char* bytes;
    size_t size;
    int nnode = 0, npair = 0;
    uint64_t ir = 0, opset = 0;
    assert_ok(om_file_read(path, 1 << 24, &bytes, &size));
    Reader r = {(unsigned char*)bytes, (unsigned char*)bytes + size};
    for (Field f; next(&r, &f);) {
        if (f.number == 1) ir = f.value;
        if (f.number == 7) nnode = check_graph(inside(&f), ops);
        if (f.number == 14) ++npair;
        if (f.number == 8) {
            Reader set = inside(&f);
            for (Field g; next(&set, &g);)
                if (g.number == 2) opset = g.value;
        }
    }
    assert_int_equal(ir, 7);
    assert_int_equal(opset, 13);
    assert_int_equal(npair, 1);
    om_free(bytes);
    return nnode;
}

static void test_structure(void** state) {
    (void)state;
    char ops[128][40], path[256];
    const OmTextPair about = {"units", "m"};
    snprintf(path, sizeof path, "%s", temp_path("net.onnx"));
    for (int i = 0; i < NNET; ++i) {
        OmNet* net = build[i]();
        float* param = make_parameters(net);
        assert_ok(om_net_save_onnx(net, param, &about, 1, path));
        int nnode = walk(path, ops);
        assert_true(nnode >= om_net_layer_count(net) - 1);
        if (build[i] == dense_net) {
            const char* expected[] = {"Flatten", "Gemm", "Reshape", "Tanh",   "Identity",
                                      "Flatten", "Gemm", "Reshape", "Sigmoid"};
            assert_int_equal(nnode, 9);
            for (int k = 0; k < 9; ++k) assert_string_equal(ops[k], expected[k]);
        }
        om_free(param);
        om_net_destroy(net);
    }
    remove(path);
}

// ---- attributes ---------------------------------------------------------------------------------------------

// All nodes as text: "Conv(a,b) strides=2,1,1 alpha=0.1 ..\n", attributes in the order of the file.
static void print_node(Reader r, char* text, size_t size) {
    char op[40] = "", inputs[400] = "", rest[600] = "";
    for (Field f; next(&r, &f);) {
        size_t at = strlen(inputs), end = strlen(rest);
        if (f.number == 1)
            snprintf(inputs + at, sizeof inputs - at, "%s%.*s", at ? "," : "", (int)f.size,
                     (const char*)f.data);
        if (f.number == 4) snprintf(op, sizeof op, "%.*s", (int)f.size, (const char*)f.data);
        if (f.number != 5) continue;
        Reader a = inside(&f);
        bool is_first = true;
        for (Field g; next(&a, &g); end = strlen(rest)) {
            float value;
            if (g.number == 1)
                snprintf(rest + end, sizeof rest - end, " %.*s=", (int)g.size, (const char*)g.data);
            if (g.number == 2) memcpy(&value, g.data, 4);
            if (g.number == 2) snprintf(rest + end, sizeof rest - end, "%g", (double)value);
            if (g.number == 4)
                snprintf(rest + end, sizeof rest - end, "%.*s", (int)g.size, (const char*)g.data);
            if (g.number == 3 || g.number == 8)
                snprintf(rest + end, sizeof rest - end, "%s%d", is_first ? "" : ",", (int)g.value);
            if (g.number == 3 || g.number == 8) is_first = false;
        }
    }
    size_t at = strlen(text);
    snprintf(text + at, size - at, "%s(%s)%s\n", op, inputs, rest);
}

static void print_nodes(const char* path, char* text, size_t size) {
    char* bytes;
    size_t length;
    text[0] = 0;
    assert_ok(om_file_read(path, 1 << 24, &bytes, &length));
    Reader r = {(unsigned char*)bytes, (unsigned char*)bytes + length};
    for (Field f; next(&r, &f);) {
        if (f.number != 7) continue;
        Reader graph = inside(&f);
        for (Field g; next(&graph, &g);)
            if (g.number == 1) print_node(inside(&g), text, size);
    }
    om_free(bytes);
}

// What the definitions of the networks above say, in ONNX's words (operator set 13).
static void test_attributes(void** state) {
    (void)state;
    static const char* const wanted[] = {
        ") transB=1\n",
        " kernel_shape=3,1,5 strides=2,1,1 pads=1,0,2,1,0,2\n",
        " alpha=0.1\n",
        " kernel_shape=3,3,3 strides=2,2,2 pads=1,1,1,1,1,1\n",
        " kernel_shape=2,3,2 strides=2,1,1 pads=0,1,0,0,1,0\n",
        "batch.weight,batch.bias,batch.running_mean,batch.running_var)",
        " axis=1\n",
        " mode=linear coordinate_transformation_mode=half_pixel\n"};
    static const char* const op[] = {"Gemm(",    "Conv(",          "LeakyRelu(",
                                     "MaxPool(", "ConvTranspose(", "BatchNormalization(",
                                     "Concat(",  "Resize("};
    static const int in[] = {0, 1, 1, 1, 1, 2, 2, 2};
    static char text[20000];
    char path[256];
    snprintf(path, sizeof path, "%s", temp_path("attributes.onnx"));
    for (int k = 0; k < 8; ++k) {
        OmNet* net = build[in[k]]();
        float* param = make_parameters(net);
        assert_ok(om_net_save_onnx(net, param, NULL, 0, path));
        print_nodes(path, text, sizeof text);
        char* line = strstr(text, op[k]);
        assert_non_null(line);
        char* end = strchr(line, '\n') + 1;
        *end = 0;
        if (!strstr(line, wanted[k])) fail_msg("%s lacks%s", line, wanted[k]);
        om_free(param);
        om_net_destroy(net);
    }
    remove(path);
}

// ---- onnxruntime --------------------------------------------------------------------------------------------

static void write_case(const char* dir, int i) {
    enum { BATCH = 2 };
    char path[512];
    OmNet* net = build[i]();
    OmNetRun* run;
    OmNetRunDef def = om_net_run_default_def(BATCH);
    float* param = make_parameters(net);
    size_t nin = BATCH * (size_t)om_net_in_size(net), nout = BATCH * (size_t)om_net_out_size(net);
    float* in = om_alloc(nin, sizeof *in);
    float* out = om_alloc(nout, sizeof *out);
    OmRng rng = om_rng_init(8, (uint64_t)i);
    for (size_t k = 0; k < nin; ++k) in[k] = (float)om_rng_normal(&rng);
    assert_ok(om_net_run_create(net, &def, &run));
    assert_ok(om_net_run_set_parameters(run, param));
    assert_ok(om_net_run_forward(run, in, out));
    snprintf(path, sizeof path, "%s/%d.onnx", dir, i);
    assert_ok(om_net_save_onnx(net, param, NULL, 0, path));
    snprintf(path, sizeof path, "%s/%d.in", dir, i);
    write_bytes(path, in, nin * sizeof *in);
    snprintf(path, sizeof path, "%s/%d.out", dir, i);
    write_bytes(path, out, nout * sizeof *out);
    om_net_run_destroy(run);
    om_free(in);
    om_free(out);
    om_free(param);
    om_net_destroy(net);
}

static void test_onnxruntime(void** state) {
    (void)state;
    const char* python = getenv("OM_PYTHON");
    char dir[256], command[1024];
    snprintf(dir, sizeof dir, "%s", temp_path("onnx"));
    assert_ok(om_path_make_dir(dir));
    for (int i = 0; i < NNET; ++i) write_case(dir, i);
    snprintf(command, sizeof command, "%s test/nn/run_onnx.py %s", python ? python : "python3",
             dir);
    int code = system(command);
    assert_ok(om_path_remove(dir));
    if (WIFEXITED(code) && WEXITSTATUS(code) == SKIP_TEST_CODE)
        test_skip("onnxruntime is not importable by %s", python ? python : "python3");
    assert_int_equal(code, 0);
}

// ---- failures -----------------------------------------------------------------------------------------------

typedef struct Saving {
    OmNet* net;
    float* param;
    char path[256];
} Saving;

static OmStatus save(void* ctx) {
    const Saving* s = ctx;
    return om_net_save_onnx(s->net, s->param, NULL, 0, s->path);
}

static void test_failures_and_memory(void** state) {
    (void)state;
    Saving s = {.net = norm_net()};
    s.param = make_parameters(s.net);
    snprintf(s.path, sizeof s.path, "%s", temp_path("memory.onnx"));
    assert_true(test_failing_allocations(save, &s, 1) >= 3);
    remove(s.path);
    assert_status(om_net_save_onnx(s.net, s.param, NULL, 0, "/nowhere/at/all.onnx"), OM_IO);
    om_free(s.param);
    om_net_destroy(s.net);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structure),
        cmocka_unit_test(test_attributes),
        cmocka_unit_test(test_onnxruntime),
        cmocka_unit_test(test_failures_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
