// image_png.c: pictures and their PNG encoding; the only file that uses libpng.
//
// libpng reports errors by longjmp. Every call of it happens in encode(), put_chunk() and decode(), behind one setjmp
// each; memory that is not libpng's lies in the structs of their callers, who free it, so a jump cannot leak.
//
// An animation is the PNG of its first picture with chunks of the Animated PNG specification between: acTL has the
// number of pictures, fcTL stands before each, and fdAT has the later ones: IDAT behind a number that counts fcTL and
// fdAT.
#include <png.h>
#include <setjmp.h>
#include <string.h>

#include "image/image_internal.h"

#define MAX_SIDE 65535
#define MAX_READ_SIDE 16384    // of a PNG file
#define MAX_FILE (256u << 20)  // bytes of a PNG file

OmStatus om_picture_init(OmPicture* picture, int width, int height, int nchannel) {
    memset(picture, 0, sizeof *picture);
    OM_CHECK(width > 0 && height > 0 && width <= MAX_SIDE && height <= MAX_SIDE, OM_INVALID,
             "a picture of %d x %d pixels", width, height);
    OM_CHECK(nchannel == 1 || nchannel == 3 || nchannel == 4, OM_INVALID,
             "a picture of %d channels: 1, 3 and 4 exist", nchannel);
    picture->pixel = om_calloc((size_t)width * (size_t)height, (size_t)nchannel);
    if (!picture->pixel) return OM_NO_MEMORY;
    picture->width = width;
    picture->height = height;
    picture->nchannel = nchannel;
    return OM_OK;
}

void om_picture_done(OmPicture* picture) {
    if (!picture) return;
    om_free(picture->pixel);
    memset(picture, 0, sizeof *picture);
}

OmStatus om_picture_shrink(const OmPicture* p, int factor, OmPicture* out) {
    *out = (OmPicture){0};
    OM_CHECK(factor >= 1 && factor <= p->width && factor <= p->height, OM_INVALID,
             "a picture of %d x %d pixels cannot be shrunk by %d", p->width, p->height, factor);
    OM_TRY(om_picture_init(out, p->width / factor, p->height / factor, p->nchannel));
    const size_t n = (size_t)p->nchannel, row = n * (size_t)p->width;
    const unsigned area = (unsigned)factor * (unsigned)factor;
    unsigned char* to = out->pixel;
    for (int y = 0; y < out->height; ++y)
        for (int x = 0; x < out->width; ++x)
            for (size_t c = 0; c < n; ++c) {
                unsigned sum = 0;
                for (int j = 0; j < factor; ++j)
                    for (int i = 0; i < factor; ++i)
                        sum += p->pixel[(size_t)(y * factor + j) * row +
                                        (size_t)(x * factor + i) * n + c];
                *to++ = (unsigned char)((sum + area / 2) / area);
            }
    return OM_OK;
}

typedef struct Encoder {
    OmText* text;
    OmStatus status;    // result of appending to the text
    char message[128];  // of libpng
} Encoder;

typedef struct Raster {
    int width, height, color, depth;
    const unsigned char* row;  // the first
    size_t stride;             // bytes
} Raster;

static void on_error(png_structp png, png_const_charp message) {
    Encoder* e = png_get_error_ptr(png);
    snprintf(e->message, sizeof e->message, "%s", message);
    longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    om_log(OM_LOG_DEBUG, "png: %s", message);
}

static void on_write(png_structp png, png_bytep data, size_t size) {
    Encoder* e = png_get_io_ptr(png);
    e->status = om_text_append_raw(e->text, (const char*)data, size);
    if (e->status < 0) png_error(png, "out of memory");
}

static void on_flush(png_structp png) { (void)png; }

static png_voidp png_alloc(png_structp png, png_alloc_size_t size) {
    (void)png;
    return om_alloc(size, 1);
}

static void png_release(png_structp png, png_voidp ptr) {
    (void)png;
    om_free(ptr);
}

static OmStatus encode(const Raster* r, OmText* text) {
    Encoder e = {.text = text, .status = OM_OK};
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &e, on_error, on_warning,
                                                NULL, png_alloc, png_release);
    if (!png) return om_error(OM_NO_MEMORY, "png: out of memory");
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        if (e.status < 0) return e.status;
        return om_error(OM_NO_MEMORY, "png: %s", e.message[0] ? e.message : "out of memory");
    }
    png_set_write_fn(png, &e, on_write, on_flush);
    png_set_IHDR(png, info, (png_uint_32)r->width, (png_uint_32)r->height, r->depth, r->color,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, 6);
    png_write_info(png, info);
    if (r->depth == 16 && om__is_little_endian()) png_set_swap(png);
    for (int y = 0; y < r->height; y++) png_write_row(png, r->row + (size_t)y * r->stride);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return OM_OK;
}

OmStatus om_picture_encode_png(const OmPicture* picture, OmText* text) {
    const OmPicture* p = picture;
    OM_CHECK(p->pixel && p->width > 0 && p->height > 0, OM_INVALID, "an empty picture");
    int color = p->nchannel == 1   ? PNG_COLOR_TYPE_GRAY
                : p->nchannel == 3 ? PNG_COLOR_TYPE_RGB
                                   : PNG_COLOR_TYPE_RGB_ALPHA;
    Raster r = {p->width, p->height, color, 8, p->pixel, (size_t)p->width * (size_t)p->nchannel};
    return encode(&r, text);
}

// ---- animations -------------------------------------------------------------------------------------------------

// One chunk, with the sum that libpng computes.
static OmStatus put_chunk(OmText* text, const char* name, const unsigned char* data, size_t size) {
    Encoder e = {.text = text, .status = OM_OK};
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &e, on_error, on_warning,
                                                NULL, png_alloc, png_release);
    if (!png) return om_error(OM_NO_MEMORY, "png: out of memory");
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, NULL);
        if (e.status < 0) return e.status;
        return om_error(OM_NO_MEMORY, "png: %s", e.message[0] ? e.message : "out of memory");
    }
    png_set_write_fn(png, &e, on_write, on_flush);
    png_write_chunk(png, (png_const_bytep)name, data, size);
    png_destroy_write_struct(&png, NULL);
    return OM_OK;
}

typedef struct Animation {
    OmText* text;
    int n;            // pictures
    unsigned ms;      // of each
    uint32_t number;  // of the next fcTL or fdAT
} Animation;

static OmStatus put_control(Animation* a, const OmPicture* p) {
    unsigned char body[26] = {0};  // place (0, 0), nothing is blended
    png_save_uint_32(body, a->number++);
    png_save_uint_32(body + 4, (png_uint_32)p->width);
    png_save_uint_32(body + 8, (png_uint_32)p->height);
    png_save_uint_16(body + 20, a->ms);
    png_save_uint_16(body + 22, 1000);
    return put_chunk(a->text, "fcTL", body, sizeof body);
}

// The chunks of picture k, which is encoded in `png`: its bytes are changed.
static OmStatus put_picture(Animation* a, int k, const OmPicture* p, OmText* png) {
    const size_t head = 8 + 25;  // signature and IHDR
    unsigned char* data = (unsigned char*)png->str;
    if (k == 0) {
        unsigned char body[8] = {0};  // without end
        png_save_uint_32(body, (png_uint_32)a->n);
        OM_TRY(om_text_append_raw(a->text, png->str, head));
        if (a->n > 1) OM_TRY(put_chunk(a->text, "acTL", body, sizeof body));
    }
    if (a->n > 1) OM_TRY(put_control(a, p));
    for (size_t at = head, size; at < png->len; at += 12 + size) {
        size = png_get_uint_32(data + at);
        if (memcmp(data + at + 4, "IDAT", 4) != 0) continue;
        if (k == 0) {
            OM_TRY(om_text_append_raw(a->text, png->str + at, 12 + size));
        } else {  // the number takes the place of the name
            png_save_uint_32(data + at + 4, a->number++);
            OM_TRY(put_chunk(a->text, "fdAT", data + at + 4, 4 + size));
        }
    }
    return OM_OK;
}

OmStatus om_picture_encode_apng(const OmPicture* picture, int n, double seconds, OmText* text) {
    OM_CHECK(n >= 1, OM_INVALID, "an animation of %d pictures", n);
    OM_CHECK(seconds >= 0.01 && seconds <= 60, OM_INVALID,
             "pictures are shown for 0.01 to 60 s, not for %g s", seconds);
    for (int k = 1; k < n; ++k)
        OM_CHECK(picture[k].width == picture->width && picture[k].height == picture->height &&
                     picture[k].nchannel == picture->nchannel,
                 OM_INVALID, "picture %d of the animation has another size than the first", k + 1);
    Animation a = {.text = text, .n = n, .ms = (unsigned)(1000 * seconds + 0.5)};
    for (int k = 0; k < n; ++k) {
        OmText png = {0};
        OmStatus status = om_picture_encode_png(&picture[k], &png);
        if (status == OM_OK) status = put_picture(&a, k, &picture[k], &png);
        om_text_done(&png);
        if (status < 0) return status;
    }
    return put_chunk(text, "IEND", NULL, 0);
}

// ---- files ------------------------------------------------------------------------------------------------------

OmStatus om_picture_save_png(const OmPicture* picture, const char* path) {
    OmText text = {0};
    OmStatus status = om_picture_encode_png(picture, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

OmStatus om_picture_save_png16(const uint16_t* value, int width, int height, const char* path) {
    OM_CHECK(width > 0 && height > 0 && width <= MAX_SIDE && height <= MAX_SIDE, OM_INVALID,
             "a picture of %d x %d pixels", width, height);
    Raster r = {
        width, height, PNG_COLOR_TYPE_GRAY, 16, (const unsigned char*)value, 2 * (size_t)width};
    OmText text = {0};
    OmStatus status = encode(&r, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

// ---- decoding ---------------------------------------------------------------------------------------------------

typedef struct Decoder {
    const char* name;      // of the file
    const char* data;      // its bytes
    size_t size, at;       // at: bytes read so far
    bool is_deep;          // 16-bit grey is wanted, else 8-bit RGB
    int width, height;     //
    unsigned char* pixel;  // rows without gaps
    png_bytep* row;
    bool is_out_of_memory;
    char message[128];  // of libpng, or ours
} Decoder;

static void on_read_error(png_structp png, png_const_charp message) {
    Decoder* d = png_get_error_ptr(png);
    snprintf(d->message, sizeof d->message, "%s", message);
    longjmp(png_jmpbuf(png), 1);
}

static void on_read(png_structp png, png_bytep out, size_t size) {
    Decoder* d = png_get_io_ptr(png);
    if (size > d->size - d->at) png_error(png, "the file ends too early");
    memcpy(out, d->data + d->at, size);
    d->at += size;
}

// Ask libpng for the wanted type. A depth picture of another type has other numbers, and is refused.
static void set_type(png_structp png, png_infop info, const Decoder* d) {
    int type = png_get_color_type(png, info), depth = png_get_bit_depth(png, info);
    if (d->is_deep) {
        if (type != PNG_COLOR_TYPE_GRAY || depth != 16) png_error(png, "not 16-bit grey");
        if (om__is_little_endian()) png_set_swap(png);
        return;
    }
    if (type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
    if (type == PNG_COLOR_TYPE_GRAY || type == PNG_COLOR_TYPE_GRAY_ALPHA) {
        if (depth < 8) png_set_expand_gray_1_2_4_to_8(png);
        png_set_gray_to_rgb(png);
    }
    if (depth == 16) png_set_scale_16(png);
    png_set_strip_alpha(png);
}

static OmStatus decode(Decoder* d) {
    png_structp png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, d, on_read_error, on_warning,
                                               NULL, png_alloc, png_release);
    if (!png) return om_error(OM_NO_MEMORY, "png: out of memory");
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_read_struct(&png, &info, NULL);
        bool is_memory = !d->message[0] || d->is_out_of_memory || strstr(d->message, "memory");
        if (is_memory) return om_error(OM_NO_MEMORY, "%s: out of memory", d->name);
        return om_error(OM_INVALID, "%s: not a PNG that can be read: %s", d->name, d->message);
    }
    png_set_read_fn(png, d, on_read);
    png_set_user_limits(png, MAX_READ_SIDE, MAX_READ_SIDE);
    png_read_info(png, info);
    set_type(png, info, d);
    (void)png_set_interlace_handling(png);
    png_read_update_info(png, info);
    d->width = (int)png_get_image_width(png, info);
    d->height = (int)png_get_image_height(png, info);
    size_t stride = (d->is_deep ? 2 : 3) * (size_t)d->width;
    if (png_get_rowbytes(png, info) != stride) png_error(png, "a type of pixels that is not known");
    d->pixel = om_alloc(stride, (size_t)d->height);
    d->row = om_alloc((size_t)d->height, sizeof *d->row);
    d->is_out_of_memory = !d->pixel || !d->row;
    if (d->is_out_of_memory) png_error(png, "out of memory");
    for (int y = 0; y < d->height; ++y) d->row[y] = d->pixel + (size_t)y * stride;
    png_read_image(png, d->row);
    png_read_end(png, NULL);
    png_destroy_read_struct(&png, &info, NULL);
    return OM_OK;
}

static OmStatus load(const char* path, bool is_deep, Decoder* d) {
    char* data;
    *d = (Decoder){.name = path, .is_deep = is_deep};
    OM_TRY(om_file_read(path, MAX_FILE, &data, &d->size));
    d->data = data;
    OmStatus status = decode(d);
    om_free(data);
    om_free(d->row);
    if (status < 0) om_free(d->pixel);
    return status;
}

OmStatus om_picture_load_png(const char* path, OmPicture* picture) {
    Decoder d;
    *picture = (OmPicture){0};
    OM_TRY(load(path, false, &d));
    *picture = (OmPicture){.width = d.width, .height = d.height, .nchannel = 3, .pixel = d.pixel};
    return OM_OK;
}

OmStatus om_picture_load_png16(const char* path, uint16_t** value, int* width, int* height) {
    Decoder d;
    *value = NULL;
    OM_TRY(load(path, true, &d));
    *value = (uint16_t*)(void*)d.pixel;  // om_alloc aligns for any type
    *width = d.width;
    *height = d.height;
    return OM_OK;
}
