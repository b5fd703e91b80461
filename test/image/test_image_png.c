// PNG files, decoded by a reader of the test's own: chunks, zlib, the five filters.
#include "image_common.h"

#include <zlib.h>

typedef struct Decoded {
    int width, height, depth, color;
    unsigned char* row;  // height x stride, unfiltered
    size_t stride;
} Decoded;

static unsigned long get32(const unsigned char* p) {
    return (unsigned long)p[0] << 24 | (unsigned long)p[1] << 16 | (unsigned long)p[2] << 8 | p[3];
}

static int paeth(int a, int b, int c) {
    int p = a + b - c, pa = abs(p - a), pb = abs(p - b), pc = abs(p - c);
    return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
}

static void unfilter(Decoded* d, const unsigned char* packed, size_t pixel) {
    for (int y = 0; y < d->height; y++) {
        const unsigned char* in = packed + (size_t)y * (d->stride + 1);
        unsigned char* out = d->row + (size_t)y * d->stride;
        for (size_t i = 0; i < d->stride; i++) {
            int a = i >= pixel ? out[i - pixel] : 0;
            int b = y > 0 ? out[i - d->stride] : 0;
            int c = y > 0 && i >= pixel ? (out - d->stride)[i - pixel] : 0;
            const int guess[] = {0, a, b, (a + b) / 2, paeth(a, b, c)};
            assert_true(in[0] < 5);
            out[i] = (unsigned char)(in[1 + i] + guess[in[0]]);
        }
    }
}

static void decode(const unsigned char* png, size_t size, Decoded* d) {
    static const int channels[] = {1, 0, 3, 0, 0, 0, 4};
    unsigned char* idat = test_malloc(size);
    size_t nidat = 0, at = 8;
    bool is_end = false;
    memset(d, 0, sizeof *d);
    assert_memory_equal(png, "\x89PNG\r\n\x1a\n", 8);
    while (at + 12 <= size) {
        size_t len = get32(png + at);
        const unsigned char* body = png + at + 8;
        assert_true(at + 12 + len <= size);
        assert_int_equal(crc32(crc32(0, NULL, 0), png + at + 4, (uInt)len + 4), get32(body + len));
        if (memcmp(png + at + 4, "IHDR", 4) == 0) {
            d->width = (int)get32(body);
            d->height = (int)get32(body + 4);
            d->depth = body[8];
            d->color = body[9];
        } else if (memcmp(png + at + 4, "IDAT", 4) == 0) {
            memcpy(idat + nidat, body, len);
            nidat += len;
        }
        is_end = memcmp(png + at + 4, "IEND", 4) == 0;
        at += 12 + len;
    }
    assert_true(is_end && at == size);
    size_t pixel = (size_t)channels[d->color] * (size_t)d->depth / 8;
    d->stride = pixel * (size_t)d->width;
    uLongf total = (uLongf)((d->stride + 1) * (size_t)d->height);
    unsigned char* packed = test_malloc(total);
    d->row = test_malloc(d->stride * (size_t)d->height);
    assert_int_equal(uncompress(packed, &total, idat, (uLong)nidat), Z_OK);
    assert_int_equal(total, (d->stride + 1) * (size_t)d->height);
    unfilter(d, packed, pixel);
    test_free(packed);
    test_free(idat);
}

static void fill(OmPicture* p) {
    OmRng rng = om_rng_init(1, 0);
    for (int i = 0; i < p->width * p->height * p->nchannel; i++)
        p->pixel[i] = (unsigned char)(i % 3 ? i / p->width : (int)om_rng_below(&rng, 256));
}

static void test_pictures_survive(void** unused) {
    (void)unused;
    static const int nchannel[] = {1, 3, 4}, color[] = {0, 2, 6};
    for (int k = 0; k < 3; k++) {
        OmPicture p;
        OmText text = {0};
        Decoded d;
        assert_ok(om_picture_init(&p, 61, 47, nchannel[k]));
        fill(&p);
        assert_ok(om_picture_encode_png(&p, &text));
        decode((const unsigned char*)text.str, text.len, &d);
        assert_int_equal(d.width, 61);
        assert_int_equal(d.height, 47);
        assert_int_equal(d.depth, 8);
        assert_int_equal(d.color, color[k]);
        assert_memory_equal(d.row, p.pixel, (size_t)(61 * 47 * nchannel[k]));
        test_free(d.row);
        om_text_done(&text);
        om_picture_done(&p);
    }
}

// Chunk by chunk: the control chunks stand before their pictures, numbers count up, and each picture, made a PNG of its
// own again, is the one that went in.
static void test_animations_survive(void** unused) {
    (void)unused;
    enum { N = 3, W = 61, H = 47, HEAD = 8 + 25 };
    OmPicture p[N];
    OmText text = {0}, still[N] = {0};
    unsigned long number = 0;
    int npicture = 0;
    for (int k = 0; k < N; k++) {
        assert_ok(om_picture_init(&p[k], W, H, 3));
        fill(&p[k]);
        p[k].pixel[k] ^= 0x81;
    }
    assert_ok(om_picture_encode_apng(p, N, 0.125, &text));
    const unsigned char* png = (const unsigned char*)text.str;
    bool has_control = false;
    for (size_t at = HEAD, len; at < text.len; at += 12 + len) {
        const unsigned char *name = png + at + 4, *body = png + at + 8;
        len = get32(png + at);
        assert_int_equal(crc32(crc32(0, NULL, 0), name, (uInt)len + 4), get32(body + len));
        if (memcmp(name, "acTL", 4) == 0) {
            has_control = true;
            assert_true(npicture == 0 && get32(body) == N && get32(body + 4) == 0);
        } else if (memcmp(name, "fcTL", 4) == 0) {
            assert_true(has_control && len == 26 && get32(body) == number++);
            assert_true(get32(body + 4) == W && get32(body + 8) == H && get32(body + 12) == 0);
            assert_int_equal((body[20] << 8) | body[21], 125);
            assert_int_equal((body[22] << 8) | body[23], 1000);
            assert_ok(om_text_append_raw(&still[npicture++], text.str, HEAD));
        } else if (memcmp(name, "IDAT", 4) == 0) {
            assert_int_equal(npicture, 1);
            assert_ok(om_text_append_raw(&still[0], text.str + at, 12 + len));
        } else if (memcmp(name, "fdAT", 4) == 0) {
            assert_true(npicture > 1 && get32(body) == number++);
            unsigned char size[4] = {0, 0, (unsigned char)((len - 4) >> 8),
                                     (unsigned char)(len - 4)};
            unsigned char* data = test_malloc(len);
            memcpy(data, "IDAT", 4);
            memcpy(data + 4, body + 4, len - 4);
            const unsigned long sum = crc32(crc32(0, NULL, 0), data, (uInt)len);
            const unsigned char end[4] = {(unsigned char)(sum >> 24), (unsigned char)(sum >> 16),
                                          (unsigned char)(sum >> 8), (unsigned char)sum};
            assert_ok(om_text_append_raw(&still[npicture - 1], (const char*)size, 4));
            assert_ok(om_text_append_raw(&still[npicture - 1], (const char*)data, len));
            assert_ok(om_text_append_raw(&still[npicture - 1], (const char*)end, 4));
            test_free(data);
        }
    }
    assert_int_equal(npicture, N);
    for (int k = 0; k < N; k++) {
        Decoded d;
        assert_ok(om_text_append_raw(&still[k], text.str + text.len - 12, 12));  // IEND
        decode((const unsigned char*)still[k].str, still[k].len, &d);
        assert_memory_equal(d.row, p[k].pixel, W * H * 3);
        test_free(d.row);
        om_text_done(&still[k]);
    }
    om_text_done(&text);
    // one picture is a plain PNG
    OmText one = {0}, plain = {0};
    assert_ok(om_picture_encode_apng(p, 1, 1, &one));
    assert_ok(om_picture_encode_png(p, &plain));
    assert_true(one.len == plain.len && memcmp(one.str, plain.str, one.len) == 0);
    om_text_done(&one);
    om_text_done(&plain);
    assert_status(om_picture_encode_apng(p, 0, 1, &one), OM_INVALID);
    assert_status(om_picture_encode_apng(p, N, 0, &one), OM_INVALID);
    om_picture_done(&p[2]);
    assert_ok(om_picture_init(&p[2], W, H + 1, 3));
    assert_status(om_picture_encode_apng(p, N, 1, &one), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "picture 3"));
    om_text_done(&one);
    for (int k = 0; k < N; k++) om_picture_done(&p[k]);
}

static void test_depth_images_survive(void** unused) {
    (void)unused;
    enum { W = 33, H = 20 };
    uint16_t value[W * H];
    Decoded d;
    char* png;
    size_t size;
    for (int i = 0; i < W * H; i++) value[i] = (uint16_t)(i * 97);
    const char* path = temp_path("depth.png");
    assert_ok(om_picture_save_png16(value, W, H, path));
    assert_ok(om_file_read(path, 1 << 20, &png, &size));
    decode((const unsigned char*)png, size, &d);
    assert_int_equal(d.depth, 16);
    for (size_t i = 0; i < W * H; i++)
        assert_int_equal(d.row[2 * i] << 8 | d.row[2 * i + 1], value[i]);
    test_free(d.row);
    om_free(png);
    remove(path);
}

// Means of squares of pixels, rounded; what does not fill a square is left out.
static void test_shrink(void** unused) {
    (void)unused;
    OmPicture p, small;
    assert_ok(om_picture_init(&p, 5, 4, 3));
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x)
            for (int c = 0; c < 3; ++c)
                p.pixel[(y * 5 + x) * 3 + c] = (unsigned char)(10 * y + x + 50 * c);
    assert_ok(om_picture_shrink(&p, 2, &small));
    assert_int_equal(small.width, 2);
    assert_int_equal(small.height, 2);
    // of pixel (x, y): rows 2y and 2y + 1, columns 2x and 2x + 1
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x)
            for (int c = 0; c < 3; ++c)
                assert_int_equal(small.pixel[(y * 2 + x) * 3 + c],
                                 (int)(10 * (2 * y + 0.5) + 2 * x + 0.5 + 50 * c + 0.5));
    om_picture_done(&small);
    assert_ok(om_picture_shrink(&p, 1, &small));
    assert_memory_equal(small.pixel, p.pixel, 60);
    om_picture_done(&small);
    assert_status(om_picture_shrink(&p, 0, &small), OM_INVALID);
    assert_status(om_picture_shrink(&p, 5, &small), OM_INVALID);
    om_picture_done(&p);
}

static void test_bad_pictures(void** unused) {
    (void)unused;
    OmPicture p;
    OmText text = {0};
    assert_status(om_picture_init(&p, 0, 5, 3), OM_INVALID);
    assert_status(om_picture_init(&p, 5, 70000, 3), OM_INVALID);
    assert_status(om_picture_init(&p, 5, 5, 2), OM_INVALID);
    assert_status(om_picture_encode_png(&p, &text), OM_INVALID);
    assert_status(om_picture_save_png16(NULL, 0, 1, "/tmp/x.png"), OM_INVALID);
    assert_ok(om_picture_init(&p, 4, 4, 3));
    assert_status(om_picture_save_png(&p, "/nowhere/a.png"), OM_IO);
    om_picture_done(&p);
    om_picture_done(NULL);
}

static void test_failing_allocations(void** unused) {
    (void)unused;
    const OmAllocator failing = {failing_alloc, failing_free, NULL};
    countdown = -1;
    om_allocator_set(&failing);
    OmPicture p[2];
    for (int k = 0; k < 2; k++) {
        assert_ok(om_picture_init(&p[k], 61, 47, 3));
        fill(&p[k]);
    }
    int64_t alive = om_alloc_alive();
    int n = 0;
    for (OmStatus status = OM_NO_MEMORY; status != OM_OK; n++) {
        OmText text = {0};
        countdown = n;
        status = om_picture_encode_apng(p, 2, 1, &text);
        om_text_done(&text);
        assert_true(status == OM_OK || status == OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    assert_true(n > 12);
    for (int k = 0; k < 2; k++) om_picture_done(&p[k]);
    om_allocator_set(NULL);
}

// Read again: colours keep their bytes, grey becomes three equal channels, RGBA loses its alpha; 16 bits stay.
static void test_files_are_read(void** unused) {
    (void)unused;
    enum { W = 37, H = 23 };
    const char* path = temp_path("read.png");
    for (int n = 1; n <= 4; ++n) {
        OmPicture p, q;
        if (n == 2) continue;
        assert_ok(om_picture_init(&p, W, H, n));
        for (int i = 0; i < W * H * n; ++i) p.pixel[i] = (unsigned char)(i * 31 + i / 7);
        assert_ok(om_picture_save_png(&p, path));
        assert_ok(om_picture_load_png(path, &q));
        assert_int_equal(q.width, W);
        assert_int_equal(q.height, H);
        assert_int_equal(q.nchannel, 3);
        for (int i = 0; i < W * H; ++i)
            for (int c = 0; c < 3; ++c)
                assert_int_equal(q.pixel[3 * i + c], p.pixel[n * i + (n == 1 ? 0 : c)]);
        om_picture_done(&q);
        uint16_t* deep;
        int w, h;
        assert_status(om_picture_load_png16(path, &deep, &w, &h), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "not 16-bit grey"));
        assert_null(deep);
        om_picture_done(&p);
    }
    uint16_t value[W * H], *again;
    int w, h;
    for (int i = 0; i < W * H; ++i) value[i] = (uint16_t)(i * 77);
    assert_ok(om_picture_save_png16(value, W, H, path));
    assert_ok(om_picture_load_png16(path, &again, &w, &h));
    assert_true(w == W && h == H);
    assert_memory_equal(again, value, sizeof value);
    om_free(again);
    remove(path);
}

// A file cut at any byte, and one with any byte changed, is refused or read; nothing leaks.
static void test_damaged_files(void** unused) {
    (void)unused;
    const char *path = temp_path("whole.png"), *bad = temp_path("bad.png");
    OmPicture p, q;
    char* png;
    size_t size;
    assert_ok(om_picture_init(&p, 9, 5, 3));
    fill(&p);
    assert_ok(om_picture_save_png(&p, path));
    assert_ok(om_file_read(path, 1 << 20, &png, &size));
    int64_t alive = om_alloc_alive();
    for (size_t n = 0; n < size; ++n) {
        FILE* file = fopen(bad, "wb");
        assert_int_equal(fwrite(png, 1, n, file), n);
        assert_int_equal(fclose(file), 0);
        assert_status(om_picture_load_png(bad, &q), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "bad.png"));
        assert_int_equal(om_alloc_alive(), alive);
    }
    for (size_t n = 0; n < size; ++n) {
        png[n] ^= 0x55;
        FILE* file = fopen(bad, "wb");
        assert_int_equal(fwrite(png, 1, size, file), size);
        assert_int_equal(fclose(file), 0);
        png[n] ^= 0x55;
        OmStatus status = om_picture_load_png(bad, &q);
        assert_true(status == OM_OK || status == OM_INVALID);
        om_picture_done(&q);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_free(png);
    om_picture_done(&p);
    assert_status(om_picture_load_png("/nowhere/a.png", &q), OM_IO);
    remove(path);
    remove(bad);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_pictures_survive),     cmocka_unit_test(test_animations_survive),
        cmocka_unit_test(test_depth_images_survive), cmocka_unit_test(test_shrink),
        cmocka_unit_test(test_bad_pictures),         cmocka_unit_test(test_files_are_read),
        cmocka_unit_test(test_damaged_files),        cmocka_unit_test(test_failing_allocations),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
