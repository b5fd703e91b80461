// fuzz_image_png.c: the readers of PNG pictures, 8-bit colour and 16-bit grey.
#include "fuzz_common.h"
#include "omentum/image.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const char* path = fuzz_file(data, size, ".png");
    OmPicture picture;
    OmStatus status = om_picture_load_png(path, &picture);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK) {
        // What was accepted has all of its pixels.
        unsigned sum = 0;
        FUZZ_EXPECT(picture.width > 0 && picture.height > 0 && picture.nchannel == 3);
        size_t n = 3 * (size_t)picture.width * (size_t)picture.height;
        for (size_t i = 0; i < n; ++i) sum += picture.pixel[i];
        FUZZ_EXPECT(sum <= 255 * n);
    } else {
        FUZZ_EXPECT(!picture.pixel && om_error_message()[0] != '\0');
    }
    om_picture_done(&picture);
    uint16_t* value;
    int width, height;
    status = om_picture_load_png16(path, &value, &width, &height);
    FUZZ_EXPECT(status <= 0 && (status == OM_OK) == (value != NULL));
    if (status == OM_OK) FUZZ_EXPECT(width > 0 && height > 0);
    om_free(value);
    fuzz_file_done(path);
    return 0;
}
