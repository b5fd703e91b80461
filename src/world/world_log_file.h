// world_log_file.h: records of the log of a world and their file (world_log_file.c).
#ifndef OMENTUM_WORLD_LOG_FILE_H
#define OMENTUM_WORLD_LOG_FILE_H

#include "omentum/world_log.h"

typedef enum LogKind {
    LOG_HEAD,
    LOG_RESET,
    LOG_MOVE,
    LOG_JAW,
    LOG_STOP,
    LOG_ADVANCE,
    LOG_OBSERVE,
    LOG_END,
    LOG_NKIND,
    LOG_CUT = LOG_NKIND  // not in a file: it ends here without LOG_END
} LogKind;

typedef struct LogHead {
    int narm;
    unsigned sources;
    bool has_psm[OM_MAX_ARM];
    OmPsm psm[OM_MAX_ARM];
} LogHead;

typedef struct LogCall {  // one call and its answer
    LogKind kind;
    int arm;        // of a move, a jaw and a stop
    OmPose goal;    // of a move
    double value;   // speed of a move, angle of a jaw, time step of an advance
    unsigned what;  // of an observation
    OmStatus status;
    char message[512];          // of an error
    OmObservation observation;  // of an observation without error; om_observation_done frees
} LogCall;

typedef struct LogRecordHead {  // of a record in the file
    uint32_t kind, size;        // size: bytes of the payload that follows
    uint64_t hash;
} LogRecordHead;
// Hash of a record behind one whose hash is `before`; OM_HASH_SEED before the first.
uint64_t om__log_hash(uint32_t kind, const void* data, size_t size, uint64_t before);

// Round the depth of an observation to the steps of the log.
void om__log_round(OmObservation* observation);

typedef struct
    LogBefore {  // the last colour picture of a camera, from which the next one is predicted
    unsigned char* pixel;
    size_t size, capacity;  // size 0: none
} LogBefore;

typedef struct LogWriter {
    FILE* file;  // null: ended
    char path[OM_SCENE_PATH];
    uint64_t hash;       // of all records so far
    OmText record;       // the record that is being written
    unsigned char* raw;  // of a picture before and after compression
    size_t raw_capacity;
    LogBefore before[2];  // endoscope, depth camera
} LogWriter;
OmStatus om__log_begin(const char* path, const LogHead* head, LogWriter* writer);
/// The call's observation was rounded. @return OM_OK; OM_INVALID (a value that is not finite); OM_NO_MEMORY; OM_IO
OmStatus om__log_write(LogWriter* writer, const LogCall* call);
OmStatus om__log_end(LogWriter* writer);  // complete and close
void om__log_writer_done(LogWriter* writer);

typedef struct LogReader {
    FILE* file;
    char path[OM_SCENE_PATH];
    uint64_t left;          // bytes of the file that follow
    uint64_t size;          // of the file
    uint64_t hash;          // of all records so far
    int nrecord;            // so far
    LogHead head;           //
    unsigned char* record;  // bytes of one
    size_t record_capacity;
    unsigned char* raw;  // of a picture
    size_t raw_capacity;
    LogBefore before[2];  // endoscope, depth camera
} LogReader;
OmStatus om__log_open(const char* path, LogReader* reader);
/// The next record. At the end its kind is LOG_END, or LOG_CUT. The observation that `call` held is freed.
OmStatus om__log_read(LogReader* reader, LogCall* call);
void om__log_close(LogReader* reader);

#endif
