// fuzz_world_log.c: the reader of a world's log. The hashes of the input are set right first: they would refuse it.
#include "fuzz_common.h"
#include "world/world_log_file.h"

#define FRONT 20  // bytes before the first record

// Set the hash of every record by its bytes.
static void set_hashes(uint8_t* data, size_t size) {
    uint64_t hash = OM_HASH_SEED;
    for (size_t at = FRONT; at + sizeof(LogRecordHead) <= size;) {
        LogRecordHead head;
        memcpy(&head, data + at, sizeof head);
        at += sizeof head;
        if (head.size > size - at) return;
        head.hash = hash = om__log_hash(head.kind, data + at, head.size, hash);
        memcpy(data + at - sizeof head, &head, sizeof head);
        at += head.size;
    }
}

// Write all that can be read to another log. @return whether the first one is whole and good
static bool copy_log(const char* from, const char* to) {
    LogReader reader;
    LogWriter writer;
    LogCall call = {.kind = LOG_HEAD};
    remove(to);
    if (om__log_open(from, &reader) != OM_OK) {
        FUZZ_EXPECT(om_error_message()[0] != '\0');
        return false;
    }
    FUZZ_EXPECT(om__log_begin(to, &reader.head, &writer) == OM_OK);
    OmStatus status = OM_OK;
    while (status == OM_OK && call.kind != LOG_END && call.kind != LOG_CUT) {
        status = om__log_read(&reader, &call);
        FUZZ_EXPECT(status == OM_OK || (status < 0 && om_error_message()[0] != '\0'));
        bool is_call = status == OM_OK && call.kind < LOG_END;
        if (is_call) FUZZ_EXPECT(om__log_write(&writer, &call) == OM_OK);
    }
    bool is_whole = status == OM_OK && call.kind == LOG_END;
    FUZZ_EXPECT(om__log_end(&writer) == OM_OK);
    om_observation_done(&call.observation);
    om__log_writer_done(&writer);
    om__log_close(&reader);
    return is_whole;
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    char second[160], third[160], *a, *b;
    size_t na, nb;
    uint8_t* copy = malloc(size ? size : 1);
    FUZZ_EXPECT(copy != NULL);
    memcpy(copy, data, size);
    set_hashes(copy, size);
    const char* path = fuzz_file(copy, size, ".log");
    free(copy);
    snprintf(second, sizeof second, "%s.2", path);
    snprintf(third, sizeof third, "%s.3", path);
    // What was read is written, and read again to the same bytes. The first may be compressed in another way.
    if (copy_log(path, second)) {
        FUZZ_EXPECT(copy_log(second, third));
        FUZZ_EXPECT(om_file_read(second, 1 << 28, &a, &na) == OM_OK);
        FUZZ_EXPECT(om_file_read(third, 1 << 28, &b, &nb) == OM_OK);
        FUZZ_EXPECT(na == nb && memcmp(a, b, na) == 0);
        om_free(a);
        om_free(b);
    }
    remove(second);
    remove(third);
    fuzz_file_done(path);
    return 0;
}
