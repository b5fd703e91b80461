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

OmStatus om_text_append_html(OmText* text, const char* str) {
    for (; *str; ++str) {
        const char* entity = NULL;
        switch (*str) {
        case '&': entity = "&amp;"; break;
        case '<': entity = "&lt;"; break;
        case '>': entity = "&gt;"; break;
        case '"': entity = "&quot;"; break;
        case '\'': entity = "&#39;"; break;
        default: break;
        }
        OM_TRY(entity ? om_text_append_raw(text, entity, strlen(entity))
                      : om_text_append_raw(text, str, 1));
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
    int best = (int)strlen(word) / 2 + 1;  // further away is no typing error
    for (int i = 0; i < count; ++i) {
        int d = edit_distance(word, candidate[i]);
        if (d < best) {
            best = d;
            nearest = candidate[i];
        }
    }
    return nearest;
}
