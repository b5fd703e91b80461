// base_number.c: decimal numbers in files, independent of the program's locale.
//
// strtod and printf follow the locale's decimal point, so a file written under one locale would not be
// read under another. Reading collects at most 19 significant digits. When they and the power of ten
// are exact doubles one multiplication rounds correctly (Clinger 1990), which is the case for most
// numbers of meshes; the others go to strtod as an integer with an exponent, without a decimal
// point.
#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/base.h"

#define MAX_DIGIT 19  // fits 64 bits

static const double power_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                      1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                      1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

typedef struct Decimal {  // digit * 10^exponent
    uint64_t mantissa;
    int ndigit;  // significant digits in the mantissa
    int exponent;
    bool is_cut;  // nonzero digits were dropped
} Decimal;

static bool is_digit(const char* p, const char* end) { return p < end && *p >= '0' && *p <= '9'; }

static const char* scan_digits(const char* p, const char* end, bool is_fraction, Decimal* d) {
    for (; is_digit(p, end); ++p) {
        unsigned digit = (unsigned)(*p - '0');
        if (d->ndigit < MAX_DIGIT) {
            d->mantissa = d->mantissa * 10 + digit;
            d->ndigit += d->mantissa != 0;
            d->exponent -= is_fraction;
        } else {
            d->is_cut |= digit != 0;
            d->exponent += !is_fraction;
        }
        if (d->exponent > 100000) d->exponent = 100000;
        if (d->exponent < -100000) d->exponent = -100000;
    }
    return p;
}

// The digits of the exponent if they are well formed; otherwise the number ends before the letter e.
static const char* scan_exponent(const char* p, const char* end, Decimal* d) {
    if (p >= end || (*p != 'e' && *p != 'E' && *p != 'd' && *p != 'D')) return p;
    const char* q = p + 1;
    bool is_negative = q < end && *q == '-';
    if (q < end && (*q == '-' || *q == '+')) ++q;
    if (!is_digit(q, end)) return p;
    int e = 0;
    for (; is_digit(q, end); ++q) {
        if (e < 100000) e = e * 10 + (*q - '0');
    }
    d->exponent += is_negative ? -e : e;
    return q;
}

static double decimal_value(const Decimal* d) {
    if (d->mantissa == 0) return 0;
    if (!d->is_cut && d->mantissa <= (1ull << 53) && d->exponent >= -22 && d->exponent <= 22) {
        double m = (double)d->mantissa;
        return d->exponent < 0 ? m / power_of_ten[-d->exponent] : m * power_of_ten[d->exponent];
    }
    char text[48];
    snprintf(text, sizeof text, "%llue%d", (unsigned long long)d->mantissa, d->exponent);
    return strtod(text, NULL);
}

static bool starts_with_word(const char* p, const char* end, const char* word) {
    for (; *word; ++p, ++word) {
        if (p >= end || (*p | 0x20) != *word) return false;
    }
    return true;
}

bool om_number_parse(const char** str, const char* end, double* value) {
    const char* p = *str;
    bool is_negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) ++p;
    double v = 0;
    if (starts_with_word(p, end, "nan")) {
        v = (double)NAN;
        p += 3;
    } else if (starts_with_word(p, end, "inf")) {
        v = (double)INFINITY;
        p += starts_with_word(p, end, "infinity") ? 8 : 3;
    } else {
        Decimal d = {0};
        const char* digits = p;
        p = scan_digits(p, end, false, &d);
        bool has_digit = p > digits;
        if (p < end && *p == '.') {
            const char* fraction = p + 1;
            p = scan_digits(fraction, end, true, &d);
            has_digit |= p > fraction;
        }
        if (!has_digit) return false;
        p = scan_exponent(p, end, &d);
        v = decimal_value(&d);
    }
    *str = p;
    *value = is_negative ? -v : v;
    return true;
}

bool om_integer_parse(const char** str, const char* end, int64_t* value) {
    const char* p = *str;
    bool is_negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) ++p;
    if (!is_digit(p, end)) return false;
    uint64_t v = 0;
    for (; is_digit(p, end); ++p) {
        uint64_t digit = (uint64_t)(*p - '0');
        if (v > (INT64_MAX - digit) / 10) return false;
        v = v * 10 + digit;
    }
    *str = p;
    *value = is_negative ? -(int64_t)v : (int64_t)v;
    return true;
}

int om_number_write(char* out, double value) {
    int n = snprintf(out, OM_NUMBER_SIZE, "%.17g", value);
    const struct lconv* locale = localeconv();
    const char* point = locale->decimal_point;
    if (strcmp(point, ".") != 0 && point[0]) {
        char* at = strstr(out, point);
        size_t len = strlen(point);
        if (at) {
            *at = '.';
            memmove(at + 1, at + len, strlen(at + len) + 1);
            n -= (int)len - 1;
        }
    }
    return n;
}
