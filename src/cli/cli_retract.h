// cli_retract.h: the scene and the settings of a run, for the verbs that run or measure a scene.
#ifndef OM_CLI_RETRACT_H
#define OM_CLI_RETRACT_H

#include "cli_common.h"
#include "cli_supervise.h"
#include "omentum/retract.h"
#include "omentum/rl_acting.h"

#define OM_CLI_NAMES 100  // bytes of the names of arms

typedef struct OmCliRetract {
    const char* verb;  // for messages
    OmScene scene;
    OmEngineSet engines;  // that the scene may name: those of the library, and the trained network
    const char *out, *program;
    int nlayout;  // of several
    int first;    // of these
    int nworker;
    int igtl_port;  // 0: not served
    bool is_quiet;
    bool has_layout, has_data;  // of the command line
    bool records_acquisitions, records_observations;
    bool is_defras, has_preplan, needs_approval, has_both_arms;
    OmPreplan preplan;
    OmCliPerson person;
    bool has_robot;  // --world dds
    OmDdsWorldDef robot;
    OmDdsFrame frame[OM_DDS_MAX_FRAME];  // of --frames
    char arms[OM_CLI_NAMES];             // of --arms
    OmRlActing* acting;                  // null: straight lines
    bool has_scene;                      // `scene` is there: it is not read from the first argument
    bool needs_scene;                    // false: only a text is wanted
} OmCliRetract;

// Read options and scene. Returns OM_EXIT_OK, or the exit code after a message.
int om_cli_retract_begin(const OmCliArgs* args, bool needs_folder, OmCliRetract* s);
// The options of OM_CLI_OPTION_DDS.
OmStatus om_cli_dds(const OmCliArgs* args, OmDdsDef* dds);
// The names of --arms, to `text` and pointers into it; without the option nothing is changed.
OmStatus om_cli_arms(const OmCliArgs* args, char text[OM_CLI_NAMES], const char* arm[OM_MAX_ARM]);
// The definition of a run into `dir`.
OmRetractDef om_cli_retract_def(OmCliRetract* s, const char* dir);
// The plan before the operation in `dir`, where the user wants one and has none. `trials` receives the file of its
// trials; without a folder (null) none are kept.
OmStatus om_cli_retract_plan(OmCliRetract* s, const char* dir, char* trials, size_t size);

// Options of more than one verb.
#define OM_CLI_OPTION_DATA                                                           \
    {                                                                                \
        "--data", NULL, "DIR", "folder that the scene's file names are relative to", \
            "the scene's folder"                                                     \
    }
#define OM_CLI_OPTION_DDS                                                                    \
    {"--domain", NULL, "N", "DDS domain, as ROS_DOMAIN_ID", "0", NULL, 0, 232},              \
        {"--network", NULL, "NAME", "interface, with multicast", "loopback, without"}, {     \
        "--peer", NULL, "ADDRESS", "address of a machine, without multicast", "this machine" \
    }
#define OM_CLI_OPTION_ARMS \
    { "--arms", NULL, "NAMES", "names of both arms, with a comma: PSM2,PSM3", "PSM1,PSM2" }
#define OM_CLI_OPTION_WORKERS \
    { "--workers", NULL, "N", "threads", "one a processor", NULL, 0, OM_MAX_WORKER }
#define OM_CLI_OPTION_QUIET \
    { "--quiet", "-q", NULL, "no progress" }
#define OM_CLI_OPTION_FORCE                                                              \
    {                                                                                    \
        "--force-threshold", NULL, "N", "largest force on the tissue, without a margin", \
            "the scene's, with its margin", "N", 1e-3, 1e3                               \
    }

#endif
