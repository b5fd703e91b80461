// image_segment.c: names of the segments of a label map, and the volume of a file that holds them.
//
// 3D Slicer's .seg.nrrd describes segment N by keys "SegmentN_Name", "_ID", "_LabelValue" and "_Layer".
// Overlapping segments lie in several layers, the entries of a fourth axis. Versions before 4.11 write
// neither value nor layer: segment N is where entry N is 1. In NIfTI several programs write an XML table
// of labels into an extension of the header.
#include <limits.h>
#include <string.h>

#include "image/image_internal.h"

OmStatus om__segment_at(OmVolumeInfo* info, int index, OmSegment** segment) {
    OM_CHECK(index >= 0 && index < OM_SEGMENT_MAX, OM_INVALID,
             "segment %d: segments 0 to %d are read", index, OM_SEGMENT_MAX - 1);
    if (index >= info->nsegment) {
        OmSegment* grown =
            om_realloc(info->segment, (size_t)info->nsegment, (size_t)index + 1, sizeof *grown);
        if (!grown) return OM_NO_MEMORY;
        info->segment = grown;
        for (; info->nsegment <= index; info->nsegment++)
            grown[info->nsegment] = (OmSegment){.layer = -1, .value = -1};
    }
    *segment = &info->segment[index];
    return OM_OK;
}

void om__segment_name(const char* str, size_t len, char out[OM_SEGMENT_NAME]) {
    size_t n = 0;
    for (size_t i = 0; i < len && n + 1 < OM_SEGMENT_NAME;) {
        const unsigned char* c = (const unsigned char*)str + i;
        size_t step = om_utf8_length(str + i, len - i);
        bool is_control = *c < 0x20 || *c == 0x7f || (step == 2 && *c == 0xc2 && c[1] < 0xa0);
        if (step == 0 || is_control) {
            out[n++] = step == 0 ? '?' : ' ';
            i += step ? step : 1;
            continue;
        }
        if (n + step >= OM_SEGMENT_NAME) break;
        memcpy(out + n, c, step);
        n += step;
        i += step;
    }
    while (n > 0 && out[n - 1] == ' ') n--;
    out[n] = 0;
}

// ---- NRRD -----------------------------------------------------------------------------------------------

static OmStatus read_whole(const char* key, const char* str, size_t len, int* value) {
    const char *p = str, *end = str + len;
    int64_t v = 0;
    bool is_good = om_integer_parse(&p, end, &v) && p == end && v >= 0 && v <= INT_MAX;
    OM_CHECK(is_good, OM_INVALID, "key %s: \"%.*s\" is no whole number above or equal 0", key,
             len < 40 ? (int)len : 40, str);
    *value = (int)v;
    return OM_OK;
}

OmStatus om__segment_read_key(const char* line, size_t len, OmVolumeInfo* info) {
    static const char head[] = "Segment";
    char key[64];
    const char* colon = memchr(line, ':', len);
    size_t nkey = (size_t)(colon - line);
    if (nkey >= sizeof key || nkey < sizeof head || memcmp(line, head, sizeof head - 1) != 0)
        return OM_OK;
    memcpy(key, line, nkey);
    key[nkey] = 0;
    const char* p = key + sizeof head - 1;
    int64_t index;
    if (*p < '0' || *p > '9' || !om_integer_parse(&p, key + nkey, &index) || *p != '_')
        return OM_OK;  // Segmentation_...
    OM_CHECK(index < OM_SEGMENT_MAX, OM_INVALID, "key %s: segments 0 to %d are read", key,
             OM_SEGMENT_MAX - 1);
    const char* value = colon + 2;
    size_t nvalue = len - nkey - 2;
    while (nvalue > 0 && value[nvalue - 1] == ' ') nvalue--;
    OmSegment* segment;
    OM_TRY(om__segment_at(info, (int)index, &segment));
    info->has_layers = true;
    if (strcmp(p, "_Name") == 0) om__segment_name(value, nvalue, segment->name);
    if (strcmp(p, "_ID") == 0) om__segment_name(value, nvalue, segment->id);
    if (strcmp(p, "_LabelValue") == 0) return read_whole(key, value, nvalue, &segment->value);
    if (strcmp(p, "_Layer") == 0) return read_whole(key, value, nvalue, &segment->layer);
    return OM_OK;
}

OmStatus om__segment_finish(OmVolumeInfo* info) {
    bool is_old = info->nsegment == info->nentry;  // each segment has a layer of its own
    info->has_layers = info->has_layers && info->nentry > 1;
    for (int s = 0; s < info->nsegment; s++) {
        OmSegment* segment = &info->segment[s];
        bool has_value = segment->value >= 0;
        if (segment->layer < 0) segment->layer = is_old && !has_value ? s : 0;
        if (!has_value) segment->value = is_old ? 1 : s + 1;
        OM_CHECK(segment->layer < info->nentry, OM_INVALID,
                 "key Segment%d_Layer: %d; the file has layers 0 to %d", s, segment->layer,
                 info->nentry - 1);
    }
    return OM_OK;
}

// ---- NIfTI ----------------------------------------------------------------------------------------------

static const char* find_text(const char* p, const char* end, const char* wanted) {
    size_t len = strlen(wanted);
    for (; (size_t)(end - p) >= len; p++) {
        p = memchr(p, wanted[0], (size_t)(end - p) - len + 1);
        if (!p) return NULL;
        if (memcmp(p, wanted, len) == 0) return p;
    }
    return NULL;
}

OmStatus om__segment_read_table(const char* text, size_t size, OmVolumeInfo* info) {
    const char *end = text + size, *p = find_text(text, end, "<LabelTable");
    while (p && (p = find_text(p, end, "<Label ")) != NULL) {
        const char* close = memchr(p, '>', (size_t)(end - p));
        const char* key = close ? find_text(p, close, "Key=\"") : NULL;
        const char* stop = close ? find_text(close, end, "</Label>") : NULL;
        if (!stop) break;
        p = stop;
        int64_t value;
        if (!key) continue;
        key += 5;
        if (!om_integer_parse(&key, close, &value) || value <= 0 || value > INT_MAX) continue;
        const char *name = close + 1, *behind = stop;
        const char* data = find_text(name, stop, "<![CDATA[");
        if (data) {
            name = data + 9;
            const char* bracket = find_text(name, stop, "]]>");
            if (bracket) behind = bracket;
        }
        if (info->nsegment == OM_SEGMENT_MAX) break;
        OmSegment* segment;
        OM_TRY(om__segment_at(info, info->nsegment, &segment));
        segment->value = (int)value;
        om__segment_name(name, (size_t)(behind - name), segment->name);
    }
    return OM_OK;
}

// ---- choice of the volume -------------------------------------------------------------------------------

OmStatus om__choose_entry(const OmVolumeTask* task, uint64_t nentry, OmVoxelLayout* layout) {
    OM_CHECK(task->entry >= 0 || nentry <= 1, OM_INVALID,
             "the file holds %llu volumes (times, components or layers of segments), and one is "
             "read: choose one of 0 to %llu (--volume N)",
             (unsigned long long)nentry, (unsigned long long)nentry - 1);
    OM_CHECK(task->entry < 0 || (uint64_t)task->entry < nentry, OM_INVALID,
             "volume %d: the file holds volumes 0 to %llu", task->entry,
             (unsigned long long)nentry - 1);
    layout->nentry = nentry;
    layout->entry = task->entry > 0 ? (uint64_t)task->entry : 0;
    return OM_OK;
}
