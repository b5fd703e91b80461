// fuzz_view_messages.c: the messages of a view as a page takes them: frames become differences, or are refused.
#include "fuzz_common.h"
#include "view/view_internal.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    char* bytes = malloc(size + 1);
    FUZZ_EXPECT(bytes);
    if (size > 0) memcpy(bytes, data, size);
    const OmStatus status = om__view_subtract(bytes, size);
    FUZZ_EXPECT(status == OM_OK || status == OM_INVALID || status == OM_NO_MEMORY);
    // what is no frame stays
    size_t at = 0;
    uint32_t length = 0, kind = 0;
    while (status == OM_OK && at + 8 <= size) {
        memcpy(&length, data + at, 4);
        memcpy(&kind, data + at + 4, 4);
        FUZZ_EXPECT(at + 4 + length <= size);
        if (kind != VIEW_FRAME) FUZZ_EXPECT(memcmp(data + at, bytes + at, 4 + length) == 0);
        at += 4 + length;
    }
    free(bytes);
    return 0;
}
