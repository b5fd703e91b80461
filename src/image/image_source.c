// image_source.c: a stream of bytes that may be compressed; the one file of this room that knows zlib.
//
// The stored bytes are in memory, the inflated ones never are as a whole: voxels are converted piece by
// piece, so a volume of 75 million bytes costs its floats and 64 KB.
#include <limits.h>
#include <string.h>
#include <zlib.h>

#include "image/image_internal.h"

bool om__is_gzip(const void* data, size_t size) {
    const unsigned char* b = data;
    return size >= 2 && b[0] == 0x1f && b[1] == 0x8b;
}

static voidpf zlib_alloc(voidpf ctx, uInt count, uInt size) {
    (void)ctx;
    return om_alloc(count, size);
}

static void zlib_free(voidpf ctx, voidpf ptr) {
    (void)ctx;
    om_free(ptr);
}

OmStatus om__source_open(OmSource* src, const void* data, size_t size, bool is_gzip) {
    OmSource open = {.data = data, .size = size};
    *src = open;
    if (!is_gzip) return OM_OK;
    z_stream* z = om_calloc(1, sizeof *z);
    if (!z) return OM_NO_MEMORY;
    z->zalloc = zlib_alloc;
    z->zfree = zlib_free;
    if (inflateInit2(z, 15 + 32) != Z_OK) {  // 32: gzip and zlib headers both
        om_free(z);
        return om_error(OM_NO_MEMORY, "out of memory in inflate");
    }
    src->stream = z;
    return OM_OK;
}

void om__source_done(OmSource* src) {
    if (src->stream) inflateEnd(src->stream);
    om_free(src->stream);
    memset(src, 0, sizeof *src);
}

uint64_t om__source_bound(const OmSource* src) {
    uint64_t left = src->size - src->pos;
    return src->stream ? (left + 64) * OM_GZIP_RATIO : left;
}

static OmStatus cut_short(const OmSource* src, size_t missing) {
    return om_error(OM_INVALID,
                    "the data end %zu bytes too early%s: the file is cut short or its header "
                    "states a wrong size",
                    missing, src->stream ? " (after inflating)" : "");
}

static OmStatus inflate_read(OmSource* src, unsigned char* out, size_t n) {
    z_stream* z = src->stream;
    while (n > 0) {
        size_t left = src->size - src->pos;
        uInt in = left > UINT_MAX ? UINT_MAX : (uInt)left;
        uInt room = n > UINT_MAX ? UINT_MAX : (uInt)n;
        z->next_in = (Bytef*)(src->data + src->pos);
        z->avail_in = in;
        z->next_out = out;
        z->avail_out = room;
        int code = inflate(z, Z_NO_FLUSH);
        src->pos += in - z->avail_in;
        out += room - z->avail_out;
        n -= room - z->avail_out;
        if (code == Z_STREAM_END) {  // another member may follow
            if (n > 0 && src->pos == src->size) return cut_short(src, n);
            if (n > 0 && inflateReset(z) != Z_OK) return om_error(OM_INVALID, "gzip: cannot go on");
            continue;
        }
        if (code == Z_MEM_ERROR) return om_error(OM_NO_MEMORY, "out of memory in inflate");
        if (code != Z_OK && code != Z_BUF_ERROR) {
            return om_error(OM_INVALID, "gzip data are damaged near byte %zu (%s)", src->pos,
                            z->msg ? z->msg : "unexpected end");
        }
        if (src->pos == src->size && n > 0 && z->avail_out > 0) return cut_short(src, n);
    }
    return OM_OK;
}

OmStatus om__source_read(OmSource* src, void* out, size_t n) {
    if (src->stream) return inflate_read(src, out, n);
    size_t left = src->size - src->pos;
    if (n > left) return cut_short(src, n - left);
    if (n) memcpy(out, src->data + src->pos, n);
    src->pos += n;
    return OM_OK;
}

OmStatus om__source_skip(OmSource* src, uint64_t n) {
    if (!src->stream) {
        size_t left = src->size - src->pos;
        if (n > left) return cut_short(src, n - left > SIZE_MAX ? SIZE_MAX : (size_t)(n - left));
        src->pos += (size_t)n;
        return OM_OK;
    }
    if (n > om__source_bound(src)) return cut_short(src, (size_t)n);
    unsigned char waste[4096];
    while (n > 0) {
        size_t part = n > sizeof waste ? sizeof waste : (size_t)n;
        OM_TRY(inflate_read(src, waste, part));
        n -= part;
    }
    return OM_OK;
}
