// image_source.c: a stream of bytes that may be compressed; the only file of this room that uses zlib.
//
// The stored bytes come from memory or, a window at a time, from a file. They are inflated directly into the
// destination, so a volume needs memory for its voxels and one window, whatever the file's size.
#include <errno.h>
#include <limits.h>
#include <string.h>
#include <zlib.h>

#include "image/image_internal.h"

#define WINDOW ((size_t)1 << 18)  // bytes of a file in memory

// ---- stored bytes -------------------------------------------------------------------------------------

// Make at least one stored byte available, unless none is left.
static OmStatus fill(OmSource* src) {
    if (src->pos < src->size || src->left == 0) return OM_OK;
    size_t want = src->left < WINDOW ? (size_t)src->left : WINDOW;
    size_t got = fread(src->window, 1, want, src->file);
    OM_CHECK(!ferror(src->file), OM_IO, "cannot read: %s", strerror(errno));
    src->left = got < want ? 0 : src->left - got;  // fewer: the file was cut in the meantime
    src->data = src->window;
    src->size = got;
    src->pos = 0;
    return OM_OK;
}

void om__source_open_memory(OmSource* src, const void* data, size_t size) {
    *src = (OmSource){.data = data, .size = size, .total = size};
}

OmStatus om__source_open_file(OmSource* src, const char* path) {
    memset(src, 0, sizeof *src);
    OM_TRY(om_file_open(path, &src->file, &src->left));
    src->total = src->left;
    src->window = om_alloc(src->left < WINDOW ? (size_t)src->left : WINDOW, 1);
    OmStatus status = src->window ? fill(src) : OM_NO_MEMORY;
    if (status < 0) {
        om__source_done(src);
        return status == OM_IO ? om_error_prefix(status, "%s", path) : status;
    }
    return OM_OK;
}

void om__source_done(OmSource* src) {
    if (src->stream) inflateEnd(src->stream);
    om_free(src->stream);
    om_free(src->window);
    if (src->file) fclose(src->file);
    memset(src, 0, sizeof *src);
}

bool om__source_begins(const OmSource* src, const char* mark, size_t size) {
    return src->size - src->pos >= size && memcmp(src->data + src->pos, mark, size) == 0;
}

static uint64_t stored_left(const OmSource* src) { return src->size - src->pos + src->left; }

uint64_t om__source_bound(const OmSource* src) {
    uint64_t left = stored_left(src);
    return src->stream ? (left + 64) * OM_GZIP_RATIO : left;
}

OmStatus om__source_line(OmSource* src, char* line, size_t size, size_t* len, bool* is_end) {
    OM_ASSERT(!src->stream);
    *len = 0;
    *is_end = false;
    for (;;) {
        OM_TRY(fill(src));
        if (src->pos == src->size) {
            *is_end = *len == 0;
            break;
        }
        const unsigned char* at = src->data + src->pos;
        const unsigned char* end = memchr(at, '\n', src->size - src->pos);
        size_t n = end ? (size_t)(end - at) : src->size - src->pos;
        for (size_t i = 0; i < n && *len + i < size; i++) line[*len + i] = (char)at[i];
        *len += n;
        src->pos += n + (end != NULL);
        if (end) break;
    }
    return OM_OK;
}

// ---- inflating ----------------------------------------------------------------------------------------

static voidpf zlib_alloc(voidpf ctx, uInt count, uInt size) {
    (void)ctx;
    return om_alloc(count, size);
}

static void zlib_free(voidpf ctx, voidpf ptr) {
    (void)ctx;
    om_free(ptr);
}

OmStatus om__source_inflate(OmSource* src) {
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

static OmStatus cut_short(const OmSource* src, uint64_t missing) {
    return om_error(OM_INVALID,
                    "the data end %llu bytes too early%s: the file is cut short or its header "
                    "states a wrong size",
                    (unsigned long long)missing, src->stream ? " (after inflating)" : "");
}

static OmStatus inflate_read(OmSource* src, unsigned char* out, size_t n) {
    z_stream* z = src->stream;
    while (n > 0) {
        OM_TRY(fill(src));
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
            if (n > 0 && stored_left(src) == 0) return cut_short(src, n);
            if (n > 0 && inflateReset(z) != Z_OK) return om_error(OM_INVALID, "gzip: cannot go on");
            continue;
        }
        if (code == Z_MEM_ERROR) return om_error(OM_NO_MEMORY, "out of memory in inflate");
        if (code != Z_OK && code != Z_BUF_ERROR) {
            return om_error(OM_INVALID, "gzip data are damaged near byte %llu (%s)",
                            (unsigned long long)(src->total - stored_left(src)),
                            z->msg ? z->msg : "unexpected end");
        }
        if (stored_left(src) == 0 && n > 0 && z->avail_out > 0) return cut_short(src, n);
    }
    return OM_OK;
}

// ---- plain or compressed ------------------------------------------------------------------------------

OmStatus om__source_read(OmSource* src, void* out, size_t n) {
    if (src->stream) return inflate_read(src, out, n);
    uint64_t left = stored_left(src);
    if (n > left) return cut_short(src, n - left);
    unsigned char* to = out;
    while (n > 0) {
        OM_TRY(fill(src));
        size_t part = src->size - src->pos < n ? src->size - src->pos : n;
        if (part == 0) return cut_short(src, n);  // the file was cut in the meantime
        memcpy(to, src->data + src->pos, part);
        src->pos += part;
        to += part;
        n -= part;
    }
    return OM_OK;
}

OmStatus om__source_skip(OmSource* src, uint64_t n) {
    if (n > om__source_bound(src)) return cut_short(src, n - om__source_bound(src));
    unsigned char waste[4096];
    while (n > 0) {
        size_t part = n > sizeof waste ? sizeof waste : (size_t)n;
        OM_TRY(om__source_read(src, waste, part));
        n -= part;
    }
    return OM_OK;
}
