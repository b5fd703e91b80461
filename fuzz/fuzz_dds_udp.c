// fuzz_dds_udp.c: the reader of commands by UDP.
#include "dds/dds_udp.h"
#include "fuzz_common.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    UdpCommand c;
    const OmStatus status = om__udp_parse((const char*)data, size, &c);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0' && c.n == 0);
        return 0;
    }
    FUZZ_EXPECT(c.n >= 0 && c.n <= 7 && strlen(c.arm) < sizeof c.arm &&
                strlen(c.text) < sizeof c.text);
    return 0;
}
