// shape_read_set.h: datasets of a recording, read by HDF5 itself.
#ifndef OM_TEST_SHAPE_READ_SET_H
#define OM_TEST_SHAPE_READ_SET_H

#include <hdf5.h>

#include "test_common.h"

// Rows of a dataset, and its values as doubles (null: none wanted).
static inline int read_set(hid_t file, const char* name, double* value, int max) {
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    if (set < 0) fail_msg("%s is not in the file", name);
    hid_t space = H5Dget_space(set);
    hsize_t dim[2] = {0, 1};
    assert_true(H5Sget_simple_extent_dims(space, dim, NULL) >= 1);
    H5Sclose(space);
    if (value) {
        assert_true((int)(dim[0] * dim[1]) <= max);
        assert_true(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0);
    }
    H5Dclose(set);
    return (int)dim[0];
}

#endif
