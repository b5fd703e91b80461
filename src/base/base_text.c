// base_text.c: growing strings, HTML and base64 escapes, the nearest word.
#include <string.h>

#include "omentum/base.h"

static OmStatus text_reserve(OmText* text, size_t extra) {
    if (extra >= SIZE_MAX - text->len - 1)
        return om_error(OM_NO_MEMORY, "text of %zu bytes", extra);
    size_t need = text->len + extra + 1;
    if (need <= text->cap) return OM_OK;
    size_t cap = text->cap ? text->cap : 256;
    while (cap < need) cap = cap > SIZE_MAX / 2 ? need : 2 * cap;
    char* str = om_realloc(text->str, text->len, cap, 1);
    if (!str) return OM_NO_MEMORY;
    text->str = str;
    text->cap = cap;
    return OM_OK;
}

OmStatus om_text_append_raw(OmText* text, const char* data, size_t len) {
    OM_TRY(text_reserve(text, len));
    if (len) memcpy(text->str + text->len, data, len);
    text->len += len;
    text->str[text->len] = 0;
    return OM_OK;
}

OmStatus om_text_append(OmText* text, const char* format, ...) {
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int len = vsnprintf(NULL, 0, format, args);
    va_end(args);
    OmStatus status = len < 0 ? om_error(OM_INVALID, "bad format \"%s\"", format)
                              : text_reserve(text, (size_t)len);
    if (status == OM_OK) {
        vsnprintf(text->str + text->len, (size_t)len + 1, format, again);
        text->len += (size_t)len;
    }
    va_end(again);
    return status;
}

// ---- characters -----------------------------------------------------------------------------------------

size_t om_utf8_length(const char* str, size_t len) {
    static const struct {
        unsigned char mask, lead;
        uint32_t min;  // code points below it have a shorter form
    } form[] = {{0x80, 0x00, 0}, {0xe0, 0xc0, 0x80}, {0xf0, 0xe0, 0x800}, {0xf8, 0xf0, 0x10000}};
    const unsigned char* c = (const unsigned char*)str;
    for (size_t n = 1; n <= 4; ++n) {
        if (len == 0 || (c[0] & form[n - 1].mask) != form[n - 1].lead) continue;
        if (n > len) return 0;
        uint32_t code = c[0] & (unsigned char)~form[n - 1].mask;
        for (size_t i = 1; i < n; ++i) {
            if ((c[i] & 0xc0) != 0x80) return 0;
            code = code << 6 | (c[i] & 0x3f);
        }
        bool is_surrogate = code >= 0xd800 && code < 0xe000;
        return code < form[n - 1].min || code > 0x10ffff || is_surrogate ? 0 : n;
    }
    return 0;
}

// The code point of a UTF-8 character, and its length.
static uint32_t take_character(const char* str, size_t len, size_t* n) {
    const unsigned char* c = (const unsigned char*)str;
    *n = om_utf8_length(str, len);
    uint32_t code = *n == 1 ? c[0] : *n == 2 ? c[0] & 0x1f : *n == 3 ? c[0] & 0x0f : c[0] & 0x07;
    for (size_t i = 1; i < *n; ++i) code = code << 6 | (c[i] & 0x3f);
    return code;
}

// Characters that YAML cannot hold unescaped: control characters of both kinds, line ends, byte order marks, and code
// points that are not characters.
static bool is_control(uint32_t code) {
    return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x2028 || code == 0x2029 ||
           code == 0xfeff || code == 0xfffe || code == 0xffff;
}

// Write the character at `str` unchanged, or escaped into `out`; *n is the number of bytes read.
static size_t plain_character(const char* str, size_t len, const char* allowed, size_t* n,
                              char out[16]) {
    uint32_t code = take_character(str, len, n);
    bool is_allowed = *n == 1 && *str && allowed && strchr(allowed, *str);
    if (*n > 0 && (is_allowed || !is_control(code))) {
        memcpy(out, str, *n);
        out[*n] = 0;
        return *n;
    }
    size_t used = 0;
    if (*n == 0) *n = 1;  // an invalid first byte
    for (size_t i = 0; i < *n; ++i)
        used += (size_t)snprintf(out + used, 16 - used, "\\x%02x", (unsigned char)str[i]);
    return used;
}

OmStatus om_text_append_plain(OmText* text, const char* data, size_t len) {
    for (size_t i = 0, n; i < len; i += n) {
        char out[16];
        size_t used = plain_character(data + i, len - i, NULL, &n, out);
        OM_TRY(om_text_append_raw(text, out, used));
    }
    return OM_OK;
}

bool om_text_is_plain(const char* data, size_t len, const char* allowed) {
    for (size_t i = 0, n; i < len; i += n) {
        char out[16];
        (void)plain_character(data + i, len - i, allowed, &n, out);
        if (memcmp(out, data + i, n) != 0) return false;
    }
    return true;
}

void om_text_make_plain(char* name, size_t size) {
    char whole[1024];
    size_t len = strlen(name), used = 0, n;
    if (om_text_is_plain(name, len, NULL)) return;
    for (size_t i = 0; i < len; i += n) {
        char out[16];
        size_t more = plain_character(name + i, len - i, NULL, &n, out);
        if (used + more >= size || used + more >= sizeof whole) break;
        memcpy(whole + used, out, more);
        used += more;
    }
    memcpy(name, whole, used);
    name[used] = 0;
}

OmStatus om_text_append_quoted(OmText* text, const char* str) {
    OM_TRY(om_text_append_raw(text, "\"", 1));
    size_t len = strlen(str);
    for (size_t i = 0, n; i < len; i += n) {
        uint32_t code = take_character(str + i, len - i, &n);
        if (n == 0) {  // an invalid byte cannot stand in a JSON string: it is escaped
            n = 1;
            OM_TRY(om_text_append(text, "\\\\x%02x", (unsigned char)str[i]));
        } else if (is_control(code)) {
            OM_TRY(om_text_append(text, "\\u%04x", (unsigned)code));
        } else {
            if (code == '"' || code == '\\') OM_TRY(om_text_append_raw(text, "\\", 1));
            OM_TRY(om_text_append_raw(text, str + i, n));
        }
    }
    return om_text_append_raw(text, "\"", 1);
}

OmStatus om_text_append_html(OmText* text, const char* str) {
    size_t len = strlen(str), n = 1;
    for (const char* end = str + len; str < end; str += n) {
        const char* entity = NULL;
        char out[16];
        size_t used = plain_character(str, (size_t)(end - str), "\n\t\r", &n, out);
        switch (*str) {
        case '&': entity = "&amp;"; break;
        case '<': entity = "&lt;"; break;
        case '>': entity = "&gt;"; break;
        case '"': entity = "&quot;"; break;
        case '\'': entity = "&#39;"; break;
        default: break;
        }
        OM_TRY(entity ? om_text_append_raw(text, entity, strlen(entity))
                      : om_text_append_raw(text, out, used));
    }
    return OM_OK;
}

OmStatus om_text_append_base64(OmText* text, const void* data, size_t size) {
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned char* p = data;
    OM_TRY(text_reserve(text, size / 3 * 4 + 4));
    for (size_t i = 0; i < size; i += 3) {
        unsigned b1 = i + 1 < size ? p[i + 1] : 0, b2 = i + 2 < size ? p[i + 2] : 0;
        unsigned word = (unsigned)p[i] << 16 | b1 << 8 | b2;
        char quad[4] = {digit[word >> 18], digit[word >> 12 & 63], digit[word >> 6 & 63],
                        digit[word & 63]};
        if (i + 1 >= size) quad[2] = '=';
        if (i + 2 >= size) quad[3] = '=';
        memcpy(text->str + text->len, quad, 4);
        text->len += 4;
    }
    text->str[text->len] = 0;
    return OM_OK;
}

void om_text_done(OmText* text) {
    if (!text) return;
    om_free(text->str);
    memset(text, 0, sizeof *text);
}

// Levenshtein distance of words cut to 63 letters.
static int edit_distance(const char* a, const char* b) {
    int na = (int)strnlen(a, 63), nb = (int)strnlen(b, 63);
    int row[64];
    for (int j = 0; j <= nb; ++j) row[j] = j;
    for (int i = 1; i <= na; ++i) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= nb; ++j) {
            int best = diagonal + (a[i - 1] != b[j - 1]);
            if (row[j] + 1 < best) best = row[j] + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            diagonal = row[j];
            row[j] = best;
        }
    }
    return row[nb];
}

const char* om_nearest_word(const char* word, const char* const* candidate, int count) {
    const char* nearest = NULL;
    int best = (int)strlen(word) / 2 + 1;  // a larger distance is not a typing error
    for (int i = 0; i < count; ++i) {
        int d = edit_distance(word, candidate[i]);
        if (d < best) {
            best = d;
            nearest = candidate[i];
        }
    }
    return nearest;
}
