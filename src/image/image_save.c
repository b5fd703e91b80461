// image_save.c: volumes to NRRD, header and raw voxels in one file.
//
// NRRD and not NIfTI: its header is text, it needs no transform of another space, and 3D Slicer reads it as it does
// NIfTI. The format: teem.sourceforge.net/nrrd/format.html.
#include <math.h>
#include <string.h>

#include "image/image_internal.h"

typedef struct Stored {  // a type of voxel in a file
    OmVoxelType type;
    const char* name;
    double lo, hi;  // of whole numbers; 0 and 0: any value
} Stored;

static const Stored stored[] = {{OM_VOXEL_U8, "uchar", 0, 255},
                                {OM_VOXEL_I16, "short", -32768, 32767},
                                {OM_VOXEL_F32, "float", 0, 0}};

static void put_value(const Stored* s, double value, void* to, size_t voxel) {
    if (s->type == OM_VOXEL_U8)
        ((uint8_t*)to)[voxel] = (uint8_t)value;
    else if (s->type == OM_VOXEL_I16)
        ((int16_t*)to)[voxel] = (int16_t)value;
    else
        ((float*)to)[voxel] = (float)value;
}

static OmStatus put_voxels(const OmVolume* v, const Stored* s, const char* path, void* to) {
    for (size_t i = 0; i < om_volume_count(v); ++i) {
        double value = om_volume_value(v, i);
        if (s->hi > s->lo) {
            value = round(value);
            OM_CHECK(value >= s->lo && value <= s->hi, OM_INVALID,
                     "%s: the value %g does not fit into voxels of type %s", path, value, s->name);
        }
        put_value(s, value, to, i);
    }
    return OM_OK;
}

static OmStatus print_header(const OmVolume* v, const Stored* s, OmText* text) {
    const OmVec3 axis[3] = {v->grid.axis.cx, v->grid.axis.cy, v->grid.axis.cz};
    const uint16_t one = 1;
    unsigned char low;
    memcpy(&low, &one, 1);
    OM_TRY(om_text_append(text,
                          "NRRD0004\ntype: %s\ndimension: 3\nspace: right-anterior-superior\n"
                          "sizes: %d %d %d\nspace directions:",
                          s->name, v->grid.dim[0], v->grid.dim[1], v->grid.dim[2]));
    for (int a = 0; a < 3; ++a)
        OM_TRY(om_text_append(text, " (%.9g,%.9g,%.9g)", 1e3 * axis[a].x, 1e3 * axis[a].y,
                              1e3 * axis[a].z));
    const OmVec3 o = v->grid.origin;
    return om_text_append(text,
                          "\nkinds: domain domain domain\nendian: %s\nencoding: raw\n"
                          "space origin: (%.9g,%.9g,%.9g)\n\n",
                          low ? "little" : "big", 1e3 * o.x, 1e3 * o.y, 1e3 * o.z);
}

OmStatus om_volume_save(const OmVolume* volume, OmVoxelType type, const char* path) {
    const Stored* s = NULL;
    for (size_t k = 0; k < sizeof stored / sizeof *stored; ++k)
        if (stored[k].type == type) s = &stored[k];
    OM_CHECK(s, OM_INVALID, "%s: voxels can be written as U8, I16 and F32 only", path);
    OM_CHECK(volume->voxel, OM_INVALID, "%s: the volume has no voxels", path);
    OmStatus status = OM_OK;
    OmText header = {0};
    OmAtomicFile file = {.lock = -1};
    void* data = NULL;
    const size_t count = om_volume_count(volume);
    OM_TRY_DONE(print_header(volume, s, &header));
    data = om_alloc(count, om_voxel_size(type));
    OM_CHECK_DONE(data, OM_NO_MEMORY, "%s: no memory for %zu voxels", path, count);
    OM_TRY_DONE(put_voxels(volume, s, path, data));
    OM_TRY_DONE(om_file_begin(path, &file));
    bool is_whole = fwrite(header.str, 1, header.len, file.stream) == header.len &&
                    fwrite(data, om_voxel_size(type), count, file.stream) == count;
    if (!is_whole) {
        om_file_abort(&file);
        status = om_error(OM_IO, "%s: cannot write all voxels; is the disk full?", path);
        goto done;
    }
    status = om_file_commit(&file);
done:
    om_free(data);
    om_text_done(&header);
    return status;
}
