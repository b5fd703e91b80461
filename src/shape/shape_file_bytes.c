// shape_file_bytes.c: base64 and zlib of VTK's XML files; the one file of this room that knows zlib.
//
// Base64 is read group by group: padding may stand in the middle, because some writers encode the
// header of an array on its own and others together with the data.
#include <limits.h>
#include <string.h>
#include <zlib.h>

#include "shape/shape_file_internal.h"

static int digit_value(unsigned char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

// The next four letters; blanks between them are skipped.
static OmStatus read_group(OmByteStream* s) {
    uint32_t word = 0;
    int nletter = 0, npad = 0;
    while (nletter < 4) {
        OM_CHECK(s->p < s->end, OM_INVALID, "base64 data end too early");
        unsigned char c = *s->p++;
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
        int digit = c == '=' ? 0 : digit_value(c);
        OM_CHECK(digit >= 0 && (npad == 0 || c == '='), OM_INVALID,
                 "\"%c\" (byte %d) is no letter of base64", c >= 32 && c < 127 ? c : '?', c);
        npad += c == '=';
        word = word << 6 | (uint32_t)digit;
        nletter++;
    }
    OM_CHECK(npad <= 2, OM_INVALID, "base64 data are damaged: \"===\"");
    s->group[0] = (unsigned char)(word >> 16);
    s->group[1] = (unsigned char)(word >> 8);
    s->group[2] = (unsigned char)word;
    s->ngroup = 3 - npad;
    s->igroup = 0;
    return OM_OK;
}

OmStatus om__stream_read(OmByteStream* s, void* out, size_t n) {
    unsigned char* o = out;
    if (!s->is_base64) {
        size_t left = (size_t)(s->end - s->p);
        OM_CHECK(n <= left, OM_INVALID, "%zu bytes are wanted, the data have %zu more", n, left);
        if (n) memcpy(o, s->p, n);
        s->p += n;
        return OM_OK;
    }
    for (size_t i = 0; i < n; i++) {
        if (s->igroup == s->ngroup) OM_TRY(read_group(s));
        o[i] = s->group[s->igroup++];
    }
    return OM_OK;
}

static voidpf zlib_alloc(voidpf ctx, uInt count, uInt size) {
    (void)ctx;
    return om_alloc(count, size);
}

static void zlib_free(voidpf ctx, voidpf ptr) {
    (void)ctx;
    om_free(ptr);
}

OmStatus om__inflate(const void* data, size_t size, void* out, size_t out_size) {
    OM_CHECK(size <= UINT_MAX && out_size <= UINT_MAX, OM_INVALID,
             "a compressed block of %zu bytes is too large", size);
    z_stream z = {.zalloc = zlib_alloc, .zfree = zlib_free};
    if (inflateInit(&z) != Z_OK) return om_error(OM_NO_MEMORY, "out of memory in inflate");
    z.next_in = (Bytef*)data;
    z.avail_in = (uInt)size;
    z.next_out = out;
    z.avail_out = (uInt)out_size;
    int code = inflate(&z, Z_FINISH);
    bool is_good = code == Z_STREAM_END && z.avail_out == 0;
    inflateEnd(&z);
    if (code == Z_MEM_ERROR) return om_error(OM_NO_MEMORY, "out of memory in inflate");
    OM_CHECK(is_good, OM_INVALID, "a compressed block is damaged or not of the stated size");
    return OM_OK;
}

OmStatus om__deflate(const void* data, size_t size, unsigned char** out, size_t* out_size) {
    *out = NULL;
    *out_size = 0;
    OM_CHECK(size <= INT_MAX, OM_INVALID, "a block of %zu bytes is too large", size);
    z_stream z = {.zalloc = zlib_alloc, .zfree = zlib_free};
    if (deflateInit(&z, 5) != Z_OK) return om_error(OM_NO_MEMORY, "out of memory in deflate");
    size_t bound = deflateBound(&z, (uLong)size);
    unsigned char* bytes = om_alloc(bound, 1);
    if (!bytes) {
        deflateEnd(&z);
        return OM_NO_MEMORY;
    }
    z.next_in = (Bytef*)data;
    z.avail_in = (uInt)size;
    z.next_out = bytes;
    z.avail_out = (uInt)bound;
    int code = deflate(&z, Z_FINISH);
    OM_ASSERT(code == Z_STREAM_END);
    (void)code;
    *out = bytes;
    *out_size = bound - z.avail_out;
    deflateEnd(&z);
    return OM_OK;
}
