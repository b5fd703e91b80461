// image_load.c: the reader of a volume by the extension or the first bytes of its file.
#include <string.h>

#include "image/image_internal.h"

static OmStatus parse(OmSource* src, const char* ext, const OmVolumeTask* task) {
    if (om__source_begins(src, "NRRD", 4)) return om__nrrd_parse(src, task);
    bool is_nifti = strcmp(ext, "nii") == 0 || strcmp(ext, "nii.gz") == 0 ||
                    strcmp(ext, "hdr") == 0 || strcmp(ext, "hdr.gz") == 0 ||
                    strcmp(ext, "img") == 0 || strcmp(ext, "img.gz") == 0;
    if (is_nifti) return om__nifti_parse(src, task);
    if (strcmp(ext, "nrrd") == 0 || strcmp(ext, "nhdr") == 0) return om__nrrd_parse(src, task);
    return om_error(OM_INVALID,
                    "\"%s\" is no extension of a volume: .nii, .nii.gz, .hdr, .nrrd and .nhdr are "
                    "read (DICOM series: convert them, for instance with dcm2niix)",
                    ext);
}

static OmStatus run_task(const OmVolumeTask* task) {
    char ext[16];
    OmSource src;
    if (task->volume) memset(task->volume, 0, sizeof *task->volume);
    memset(task->info, 0, sizeof *task->info);
    om_path_extension(task->path, ext, sizeof ext);
    OM_TRY(om_volume_refuse_dicom(task->path));
    // a name such as patient.1.nii has the extension "nii"; "seg.v2.gz" has no known one
    OM_TRY(om__source_open_file(&src, task->path));
    OmStatus status = parse(&src, ext, task);
    om__source_done(&src);
    if (status >= 0) return status;
    if (task->volume) om_volume_done(task->volume);
    return om_error_prefix(status, "%s", task->path);
}

OmStatus om_volume_load_within(const char* path, int entry, uint64_t max_size, OmVolume* volume) {
    OmVolumeInfo info;
    const OmVolumeTask task = {path, entry, max_size, volume, &info};
    OmStatus status = run_task(&task);
    om_volume_info_done(&info);
    return status;
}

OmStatus om_volume_load_entry(const char* path, int entry, OmVolume* volume) {
    memset(volume, 0, sizeof *volume);
    OM_CHECK(entry >= 0, OM_INVALID, "%s: volume %d: the volumes of a file count from 0", path,
             entry);
    return om_volume_load_within(path, entry, OM_VOLUME_MAX_SIZE, volume);
}

OmStatus om_volume_load(const char* path, OmVolume* volume) {
    return om_volume_load_within(path, -1, OM_VOLUME_MAX_SIZE, volume);
}

OmStatus om_volume_load_info(const char* path, OmVolumeInfo* info) {
    const OmVolumeTask task = {path, 0, OM_VOLUME_MAX_SIZE, NULL, info};
    OmStatus status = run_task(&task);
    if (status < 0) om_volume_info_done(info);
    return status;
}
