// image_dicom.c: DICOM files are recognised but not read; the message gives the command that converts them.
//
// Libraries that read DICOM (GDCM, DCMTK) have no C interface, bring a dozen packages, and leave the assembly
// of a series to their caller: order and spacing of slices, tilted gantries, files of many frames. dcm2niix
// does all of this and is a package of its own.
#include <dirent.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "image/image_internal.h"

enum { PREAMBLE = 128, MAX_ENTRY = 64, MAX_DEPTH = 3 };

// Does a regular file have "DICM" after the preamble?
static bool has_mark(const char* path) {
    char bytes[PREAMBLE + 4];
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode)) return false;
    FILE* file = fopen(path, "rb");
    if (!file) return false;
    bool is_whole = fread(bytes, 1, sizeof bytes, file) == sizeof bytes;
    fclose(file);
    return is_whole && memcmp(bytes + PREAMBLE, "DICM", 4) == 0;
}

// Look at the first entries of a folder, and of folders in it: on a disc, series lie below DICOM/PAT0/STU0.
static bool find_mark(const char* path, int depth, int* budget) {
    if (has_mark(path)) return true;
    DIR* dir = depth < MAX_DEPTH ? opendir(path) : NULL;
    bool is_found = false;
    for (struct dirent* e; dir && !is_found && *budget > 0 && (e = readdir(dir)) != NULL;) {
        char entry[2048];
        if (e->d_name[0] == '.') continue;
        --*budget;
        if (om_path_join(path, e->d_name, entry, sizeof entry) == OM_OK)
            is_found = find_mark(entry, depth + 1, budget);
    }
    if (dir) closedir(dir);
    return is_found;
}

OmStatus om_volume_refuse_dicom(const char* path) {
    struct stat info;
    int budget = MAX_ENTRY;
    if (!find_mark(path, 0, &budget)) return OM_OK;
    bool is_folder = stat(path, &info) == 0 && S_ISDIR(info.st_mode);
    char dir[1024];
    OM_TRY(is_folder ? om_path_join(path, "", dir, sizeof dir)
                     : om_path_dir(path, dir, sizeof dir));
    size_t len = strlen(dir);
    while (len > 1 && dir[len - 1] == '/') dir[--len] = 0;
    return om_error(OM_INVALID,
                    "%s: DICOM is not read; convert the series with: dcm2niix -z y -f %%d_%%s -o . "
                    "\"%s\" (package dcm2niix), and give the .nii.gz that it writes",
                    path, dir);
}
