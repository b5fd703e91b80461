// shape_file_scan.c: read words and numbers of a text, and values of a binary file, from memory.
//
// Lines are not counted while reading: an error computes the line number from the position.
#include <limits.h>
#include <string.h>

#include "shape/shape_file_internal.h"

OmScan om__scan(const char* data, size_t size) {
    OmScan s = {data, data, data + size};
    return s;
}

size_t om__scan_left(const OmScan* s) { return (size_t)(s->end - s->p); }

int om__scan_line(const OmScan* s) {
    int line = 1;
    for (const char* p = s->start; p < s->p && line < INT_MAX; p++) line += *p == '\n';
    return line;
}

static bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

void om__skip_space(OmScan* s) {
    while (s->p < s->end && is_space(*s->p)) s->p++;
}

void om__skip_blank(OmScan* s) {
    while (s->p < s->end && (is_space(*s->p) || *s->p == '\n')) s->p++;
}

void om__skip_line(OmScan* s) {
    const char* eol = s->p < s->end ? memchr(s->p, '\n', om__scan_left(s)) : NULL;
    s->p = eol ? eol + 1 : s->end;
}

bool om__at_line_end(OmScan* s) {
    om__skip_space(s);
    return s->p == s->end || *s->p == '\n';
}

OmWord om__read_word(OmScan* s) {
    om__skip_blank(s);
    OmWord w = {s->p, 0};
    while (s->p < s->end && !is_space(*s->p) && *s->p != '\n') s->p++;
    w.len = (size_t)(s->p - w.str);
    return w;
}

OmWord om__read_line(OmScan* s) {
    om__skip_space(s);
    OmWord w = {s->p, 0};
    om__skip_line(s);
    const char* last = s->p;
    while (last > w.str && (is_space(last[-1]) || last[-1] == '\n')) last--;
    w.len = (size_t)(last - w.str);
    return w;
}

bool om__is_word(OmWord w, const char* str) {
    return strlen(str) == w.len && (w.len == 0 || memcmp(w.str, str, w.len) == 0);
}

bool om__is_word_nocase(OmWord w, const char* str) {
    if (strlen(str) != w.len) return false;
    for (size_t i = 0; i < w.len; i++) {
        if ((w.str[i] | 0x20) != (str[i] | 0x20)) return false;
    }
    return true;
}

OmStatus om__scan_error(const OmScan* s, const char* format, ...) {
    char why[512];
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    return om_error(OM_INVALID, "line %d: %s", om__scan_line(s), why);
}

// The word at the position, for messages.
static OmWord peek(const OmScan* s) {
    OmScan copy = *s;
    OmWord w = om__read_word(&copy);
    if (w.len > 40) w.len = 40;
    return w;
}

static OmStatus not_a(const OmScan* s, const char* what, const char* wanted) {
    OmWord w = peek(s);
    if (w.len == 0) return om__scan_error(s, "the file ends where %s is wanted", what);
    return om__scan_error(s, "%s: %s is wanted, not \"%.*s\"", what, wanted, (int)w.len, w.str);
}

OmStatus om__read_double(OmScan* s, const char* what, double* v) {
    om__skip_blank(s);
    if (!om_number_parse(&s->p, s->end, v)) return not_a(s, what, "a number");
    return OM_OK;
}

OmStatus om__read_coord(OmScan* s, const char* what, double* v) {
    OM_TRY(om__read_double(s, what, v));
    if (!isfinite(*v)) return om__scan_error(s, "%s is not finite", what);
    return OM_OK;
}

OmStatus om__read_int(OmScan* s, const char* what, int64_t lo, int64_t hi, int64_t* v) {
    om__skip_blank(s);
    if (!om_integer_parse(&s->p, s->end, v)) return not_a(s, what, "a whole number");
    if (*v < lo || *v > hi) {
        return om__scan_error(s, "%s: %lld is not between %lld and %lld", what, (long long)*v,
                              (long long)lo, (long long)hi);
    }
    return OM_OK;
}

OmStatus om__check_count(const OmScan* s, const char* what, int64_t count, size_t min) {
    if (count < 0 || count > INT_MAX / 4 || (uint64_t)count * min > om__scan_left(s) + 1) {
        return om__scan_error(s, "%s: the file states %lld of them and can hold at most %zu", what,
                              (long long)count, (om__scan_left(s) + 1) / (min ? min : 1));
    }
    return OM_OK;
}

OmStatus om__read_count(OmScan* s, const char* what, size_t min, int* count) {
    int64_t n;
    OM_TRY(om__read_int(s, what, 0, INT_MAX / 4, &n));
    OM_TRY(om__check_count(s, what, n, min));
    *count = (int)n;
    return OM_OK;
}

const unsigned char* om__read_bytes(OmScan* s, const char* what, uint64_t n) {
    if (n > om__scan_left(s)) {
        om_error(OM_INVALID, "byte %zu: %s: %llu bytes are wanted, the file has %zu more",
                 (size_t)(s->p - s->start), what, (unsigned long long)n, om__scan_left(s));
        return NULL;
    }
    const unsigned char* bytes = (const unsigned char*)s->p;
    s->p += n;
    return bytes;
}

// ---- binary values ----------------------------------------------------------------------------------

size_t om__value_size(OmValueType type) {
    static const unsigned char size[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return size[type];
}

bool om__is_little(void) {
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 1;
}

// The bytes as an unsigned integer of the value's width, this machine's order.
static uint64_t load_bits(OmValueType type, const unsigned char* b, bool is_swapped) {
    size_t size = om__value_size(type);
    bool is_low_first = om__is_little() != is_swapped;
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++) bits = bits << 8 | b[is_low_first ? size - 1 - i : i];
    return bits;
}

static double bits_to_real(OmValueType type, uint64_t bits) {
    if (type == OM_VALUE_F64) {
        double v;
        memcpy(&v, &bits, sizeof v);
        return v;
    }
    uint32_t half = (uint32_t)bits;
    float v;
    memcpy(&v, &half, sizeof v);
    return (double)v;
}

int64_t om__load_integer(OmValueType type, const unsigned char* bytes, bool is_swapped) {
    uint64_t bits = load_bits(type, bytes, is_swapped);
    switch (type) {
    case OM_VALUE_I8: return (int8_t)bits;
    case OM_VALUE_I16: return (int16_t)bits;
    case OM_VALUE_I32: return (int32_t)bits;
    case OM_VALUE_F32:
    case OM_VALUE_F64: {
        double v = bits_to_real(type, bits);
        bool is_whole = v >= -9e15 && v <= 9e15 && floor(v) == v;
        return is_whole ? (int64_t)v : INT64_MIN;
    }
    default: return bits > INT64_MAX && type == OM_VALUE_U64 ? INT64_MIN : (int64_t)bits;
    }
}

double om__load_real(OmValueType type, const unsigned char* bytes, bool is_swapped) {
    if (type == OM_VALUE_F32 || type == OM_VALUE_F64)
        return bits_to_real(type, load_bits(type, bytes, is_swapped));
    return (double)om__load_integer(type, bytes, is_swapped);
}
