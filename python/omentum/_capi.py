"""The C interface as ctypes types: made by tools/python_binding.py from include/omentum, do not edit.

Structs have the text of the C header as their docstring. Fields of type OmVec3, OmQuat, OmMat3 and arrays of numbers are
NumPy views of the struct's memory, texts are str, enums are IntEnum. Arrays are passed as addresses (ndarray.ctypes.data).
"""
# ruff: noqa
from __future__ import annotations

from ctypes import (CFUNCTYPE, POINTER, c_bool, c_byte, c_char, c_char_p, c_double, c_float, c_int, c_int8, c_int16, c_int32,
                    c_int64, c_size_t, c_ubyte, c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from ._convert import Struct, complete

if TYPE_CHECKING:
    from ._convert import Choice, Numbers


# ---- constants

OM_BANET_ATTACHED = 1
OM_BANET_CLIP = 2.0
OM_BANET_LATEST = 30
OM_BANET_MARGIN = 2
OM_BANET_MULTIPLE = 16
OM_BANET_NBIN = 15
OM_BANET_NEAR = 4
OM_BANET_NET_KIND = 'BA-Net'
OM_BANET_NLEVEL = 5
OM_BANET_NSYMMETRY = 16
OM_BANET_SIDE_CELL = 64
OM_BANET_SURFACE = 2
OM_BANET_UNIT = 256
OM_BODY_NUMBERS = 8
OM_CALIBRATION_MAX_EVALUATION = 100000
OM_CALIBRATION_MAX_LANDMARK = 256
OM_CALIBRATION_MAX_LEVEL = 32
OM_CALIBRATION_MAX_PARAM = 8
OM_CALIBRATION_MAX_PATH = 32
OM_CALIBRATION_MAX_STEP = 20000
OM_CALIBRATION_MAX_TRIANGLE = 200000
OM_CALIBRATION_NAME = 48
OM_CALIBRATION_NPROFILE = 17
OM_CLOUD_AGREE = 0.003
OM_DIHEDRAL_BIN = 18
OM_ENGINE_VERSION = 1
OM_FACTS_MAX = 24
OM_HASH_SEED = 14695981039346656037
OM_LAW_LOG_FLOOR = 0.02
OM_LAW_MOST = 400
OM_LAW_POWER_FLOOR = 0.2
OM_LAW_STEP = 0.02
OM_LAYER_MAX_INPUT = 4
OM_LOOP_MAX_EMPTY = 3
OM_LOOP_MAX_FAILED = 3
OM_LOOP_MAX_LISTENER = 8
OM_LOSS_MAX_TERM = 8
OM_MATCH_ADOPT_TIME = 0.5
OM_MATCH_MAX_ADVICE = 8
OM_MAX_ARM = 2
OM_MAX_ATTACH = 8
OM_MAX_ELEM_NODE = 10
OM_MAX_ENGINE = 32
OM_MAX_LABEL = 64
OM_MAX_MATERIAL = 16
OM_MAX_NEAREST = 64
OM_MAX_OGDEN = 4
OM_MAX_PART = 16
OM_MAX_POISSON = 0.4999
OM_MAX_WORKER = 64
OM_MONITOR_MIN_MOVED = 30
OM_MONITOR_MIN_POINT = 50
OM_NAME_LEN = 64
OM_NET_NAME = 64
OM_NUMBER_SIZE = 32
OM_PATIENT_KIND = 'patient model'
OM_PI = 3.141592653589793
OM_PLAN_MAX_BLOCK = 256
OM_PLAN_MAX_GRID = 16
OM_PLAN_MAX_HORIZON = 64
OM_PLAN_NCOST = 6
OM_PSM_NCAPSULE = 4
OM_PSM_NJOINT = 6
OM_RECORDING_MAX_SURFACE = 15
OM_REGISTER_MIN_POINT = 30
OM_REPORT_MAX_SERIES = 6
OM_RETRACT_CHECK_TIME = 0.5
OM_RETRACT_SAMPLE = 0.1
OM_RETRACT_SLID = 0.15
OM_RL_GRID = 7
OM_RL_JAW_CLOSED = 0.17453292519943295
OM_RL_MAX_ACTION = 8
OM_RL_MAX_CHOICE = 64
OM_RL_MAX_INFO = 8
OM_RL_MAX_POINT = 64
OM_RL_MAX_VARIANT = 64
OM_RL_MEANING = 160
OM_RL_MIN_SIDE = 36
OM_RL_NAME = 32
OM_RL_NAPPROACH = 8
OM_RL_NMETHOD = 3
OM_RL_WAIT = -1
OM_ROI_MARGIN = 0.01
OM_SCENE_MAX_GRID = 16
OM_SCENE_NAME = 64
OM_SCENE_PATH = 512
OM_SEEN_CLOUD = -1
OM_SEEN_FORCE = -2
OM_SEGMENT_NAME = 128
OM_SERIES_FILE = 128
OM_SERIES_MAX = 10000
OM_SET_NAME = 64
OM_SITE_MATERIALS = 16
OM_STEREO_MAX_DISPARITY = 512
OM_TENSOR_MAX_HEADER = 8388608
OM_TENSOR_MAX_RANK = 8
OM_UMESH_MAX_CYCLE = 40
OM_UMESH_NET_KIND = 'U-Mesh network'
OM_UMESH_TOLERANCE = 5e-05
OM_UNIT_CM = 0.01
OM_UNIT_M = 1.0
OM_UNIT_MM = 0.001
OM_UPDATE_MAX_KEEP = 8
OM_VERSION = '0.1.0'
OM_VOLUME_MAX_SIZE = 1073741824
OM_WORLD_LOG_UNIT = 0.0001
OM_WORLD_MAX_TURN = 1.0
OM_WORLD_MIN_VISIBLE = 0.9
OM_WORLD_SETTLE_SPEED = 0.001
OM_WORLD_SETTLE_TIME = 3.0
OM_BANET_DISTANCE = 0
OM_BANET_UX = 1
OM_BANET_UY = 2
OM_BANET_UZ = 3
OM_BANET_SEEN = 4
OM_BANET_NCHANNEL = 5
OM_PSM_SHAFT_NVERT = 24
OM_PSM_SHAFT_NTRI = 44
OM_OBSERVE_VISIBILITY = 1
OM_OBSERVE_IMAGE = 2
OM_OBSERVE_DEPTH = 4
OM_OBSERVE_COLOR = 8
OM_OBSERVE_WINDOW = 16
OM_MESH_FLIP = 1
OM_MESH_KEEP_UNUSED = 2
OM_MESH_DROP_FLAT = 4
OM_RL_KEY_UP = 256
OM_RL_KEY_DOWN = 257
OM_RL_KEY_LEFT = 258
OM_RL_KEY_RIGHT = 259
OM_RL_KEY_PAGE_UP = 260
OM_RL_KEY_PAGE_DOWN = 261


class OmStatus(IntEnum):
    OK = 0
    INVALID = -1
    NO_MEMORY = -2
    IO = -3
    UNAVAILABLE = -4
    CANCELLED = -5
    NOT_CONVERGED = 1
    NOT_SPD = 2
    UNSAT = 3
    TIMEOUT = 4


class OmLogLevel(IntEnum):
    DEBUG = 0
    INFO = 1
    WARNING = 2


class OmPreconditioner(IntEnum):
    BLOCK_JACOBI = 0
    MULTIGRID = 1
    CHOLESKY = 2
    LU = 3


class OmLaw(IntEnum):
    COROTATIONAL = 0
    LINEAR = 1
    ST_VENANT_KIRCHHOFF = 2
    NEO_HOOKEAN = 3
    STABLE_NEO_HOOKEAN = 4
    MOONEY_RIVLIN = 5
    OGDEN = 6
    OGDEN_COUPLED = 7
    NLAW = 8


class OmVolumetric(IntEnum):
    LINEAR = 0
    LOG = 1
    MIXED = 2
    NVOLUMETRIC = 3


class OmElement(IntEnum):
    TET4 = 0
    TET10 = 1
    HEX8 = 2
    HEX8_MEAN = 3
    NELEMENT = 4


class OmLocking(IntEnum):
    LOCKING_NONE = 0
    NODAL_VOLUME = 1
    SMOOTHED = 2


class OmIntegrator(IntEnum):
    IMPLICIT_EULER = 0
    IMPLICIT_MIDPOINT = 1
    CENTRAL_DIFFERENCE = 2


class OmBanetWay(IntEnum):
    EXACT = 0
    CAMERA = 1
    MIXED = 2
    NWAY = 3


class OmBanetTest(IntEnum):
    TEST_EXACT = 0
    TEST_CAMERA = 1
    TEST_BOARD = 2
    TEST_TWO = 3
    NTEST = 4


class OmActivation(IntEnum):
    IDENTITY = 0
    RELU = 1
    LEAKY_RELU = 2
    TANH = 3
    SIGMOID = 4


class OmLayerKind(IntEnum):
    INPUT = 0
    CONV = 1
    CONV_UP = 2
    UPSAMPLE = 3
    MAX_POOL = 4
    DENSE = 5
    ACTIVATION = 6
    DROPOUT = 7
    BATCH_NORM = 8
    GROUP_NORM = 9
    CONCAT = 10
    MASK = 11


class OmNetType(IntEnum):
    F32 = 0
    BF16 = 1


class OmNetLayout(IntEnum):
    AUTO = 0
    BLOCKED = 1
    CHANNELS_LAST = 2


class OmLossKind(IntEnum):
    MSE = 0
    NORM = 1
    DICE = 2
    SLOPE = 3
    BCE = 4


class OmScheduleKind(IntEnum):
    CONSTANT = 0
    COSINE = 1
    ONE_CYCLE = 2


class OmOptimKind(IntEnum):
    ADAM = 0
    ADAMW = 1


class OmVoxelType(IntEnum):
    U8 = 0
    I8 = 1
    U16 = 2
    I16 = 3
    U32 = 4
    I32 = 5
    U64 = 6
    I64 = 7
    F32 = 8
    F64 = 9


class OmSenseTexture(IntEnum):
    NONE = 0
    FAT = 1
    ORGAN = 2
    STEEL = 3
    NTEXTURE = 4


class OmSensePart(IntEnum):
    TISSUE = 0
    ORGAN = 1
    ROI = 2
    HELD = 3
    BOARD = 4
    TOOL = 5
    SHAFT = 6
    NPART = 7


class OmScanPixel(IntEnum):
    UNKNOWN = 0
    TISSUE = 1
    TOOL = 2
    OTHER = 3


class OmTissueSource(IntEnum):
    SHEET = 0
    MESH = 1
    PATIENT = 2
    VOLUME = 3


class OmAttachKind(IntEnum):
    RANDOM = 0
    BOX = 1
    SET = 2


class OmBeliefKind(IntEnum):
    SAME = 0
    NONE = 1
    BOX = 2
    PATCH = 3


class OmMonitorRegion(IntEnum):
    TISSUE = 0
    MOVED = 1


class OmSiteRole(IntEnum):
    TWIN = 0
    WORLD = 1


class OmTissueMeasure(IntEnum):
    VON_MISES = 0
    PRINCIPAL_STRETCH = 1
    STRAIN = 2
    VOLUME_RATIO = 3
    ENERGY_DENSITY = 4


class OmEngineCapability(IntEnum):
    FORCES = 1
    TANGENT = 2
    STATICS = 4
    OBSTACLES = 8
    STRESS = 16
    PARTICLES = 32


class OmCalibrationNorm(IntEnum):
    MEAN = 0
    SQUARE = 1
    HUBER = 2
    TRIMMED = 3
    NNORM = 4


class OmCalibrationGlobal(IntEnum):
    NONE = 0
    EVOLUTION = 1
    CRS = 2
    ESCH = 3
    NGLOBAL = 4


class OmCalibrationLocal(IntEnum):
    NONE = 0
    SUBPLEX = 1
    BOBYQA = 2
    NLOCAL = 3


class OmCalibrationOutcome(IntEnum):
    CALIBRATED = 0
    CALIBRATION_BUDGET = 1
    CALIBRATION_UNFIT = 2


class OmProbeShape(IntEnum):
    BOX = 0
    SPHERE = 1
    CAPSULE = 2
    MESH = 3


class OmPressMethod(IntEnum):
    PENALTY = 0
    MULTIPLIERS = 1
    PRESCRIBED = 2


class OmCalibrationPathKind(IntEnum):
    REST = 0
    PRESS = 1
    LIFT = 2


class OmInstrument(IntEnum):
    LARGE_NEEDLE_DRIVER = 0
    PROGRASP = 1


class OmCloudPlace(IntEnum):
    FREE = 0
    FIXED = 1
    FAR = 2
    TOOL = 3


class OmPlanVerb(IntEnum):
    REACH = 0
    GRASP = 1
    RELEASE = 2
    PULL = 3
    MOVE_ROI = 4
    MOVE_AWAY = 5
    NVERB = 6


class OmTried(IntEnum):
    GRASP = 1
    MOVE_ROI = 2
    MOVE_AWAY = 4


class OmPreplanVerdict(IntEnum):
    CHOSEN = 0
    MORE_ACTIONS = 1
    MORE_FORCE = 2
    FRAGILE = 3
    SPREAD = 4
    HIDDEN = 5
    FORCE_LIMIT = 6
    ATTACHED = 7
    NO_TISSUE = 8
    OUT_OF_REACH = 9
    NVERDICT = 10


class OmUpdateTiming(IntEnum):
    AFTER_LATENCY = 0
    WHEN_READY = 1
    REPLAYED = 2


class OmUpdateStage(IntEnum):
    TAKEN = 0
    STARTED = 1
    ADOPTED = 2
    REFUSED = 3
    CANCELLED = 4
    DOUBTED = 5
    FOLLOWED = 6


class OmActionOutcome(IntEnum):
    DONE = 0
    EXPOSED = 1
    FORCE = 2
    HEIGHT = 3
    UNREACHED = 4
    EMPTY = 5
    SLIPPED = 6
    OUTDATED = 7
    ABORTED = 8
    WARNED = 9
    REPLANNED = 10
    HELD = 11


class OmRetractOutcome(IntEnum):
    EXPOSED = 0
    IN_VIEW = 1
    GAVE_UP = 2
    NO_PLAN = 3
    CANCELLED = 4
    ABORTED = 5
    HELD = 6


class OmHold(IntEnum):
    NONE = 0
    WARNING = 1
    STALE = 2
    LATE = 3
    UPDATE = 4
    PLANNER = 5
    TOOL = 6
    ARM = 7


class OmLoopPhase(IntEnum):
    BEGIN = 0
    VERIFY = 1
    PLAN = 2
    ACT = 3
    LOOK = 4
    LEARN = 5
    CONSENT = 6
    HOLD = 7
    ENDED = 8


class OmLoopCommandKind(IntEnum):
    PAUSE = 0
    RESUME = 1
    ABORT = 2
    CANCEL = 3
    SLOW = 4
    FORBID = 5
    ALLOW = 6
    ATTACH = 7
    FREE = 8
    REPLAN = 9
    APPROVE = 10
    REJECT = 11
    NCOMMAND = 12


class OmSpace(IntEnum):
    NONE = 0
    RAS = 1
    LPS = 2


class OmArrayType(IntEnum):
    DOUBLE = 0
    FLOAT = 1
    INT = 2
    BYTE = 3


class OmMeshFormat(IntEnum):
    VTU = 0
    VTU_ASCII = 1
    VTK = 2
    VTK_ASCII = 3
    MSH41 = 4
    MSH22 = 5


class OmRegistered(IntEnum):
    YES = 0
    ROUGHLY = 1
    NO = 2


class OmTensorType(IntEnum):
    F64 = 0
    F32 = 1
    F16 = 2
    BF16 = 3
    I64 = 4
    U64 = 5
    I32 = 6
    U32 = 7
    I16 = 8
    U16 = 9
    I8 = 10
    U8 = 11
    BOOL = 12
    F8_E4M3 = 13
    F8_E5M2 = 14
    NTYPE = 15


class OmStoreType(IntEnum):
    U8 = 0
    I16 = 1
    I32 = 2
    U64 = 3
    F32 = 4
    F64 = 5
    NSTORE = 6


class OmPbdKind(IntEnum):
    CLUSTERS = 0
    ELASTIC = 1
    LENGTHS = 2


class OmRlNet(IntEnum):
    ACTOR = 0
    CRITIC = 1


class OmRlReward(IntEnum):
    THESIS = 0
    EXPOSE = 1


class OmRlTissue(IntEnum):
    CLUSTERS = 0
    ELEMENTS = 1


class OmRlMethod(IntEnum):
    PPO = 0
    GAIL = 1
    CLONE = 2


class OmCtLabel(IntEnum):
    GAS = 0
    FAT = 1
    ORGAN = 2
    TUMOUR = 3
    NLABEL = 4


class OmYamlKind(IntEnum):
    DOUBLE = 0
    INT = 1
    BOOL = 2
    STRING = 3
    VEC3 = 4
    NUMBERS = 5
    ENUM = 6
    STRUCT = 7
    LIST = 8


# ---- structs


class OmAllocator(Struct):
    """typedef struct OmAllocator {
    void* (*alloc)(void* ctx, size_t size,
                   size_t align);  // null on failure; align is a power of two
    void (*free)(void* ctx, void* ptr);
    void* ctx;
} OmAllocator;"""
    alloc: Any
    free: Any
    ctx: Any


class OmArena(Struct):
    """typedef struct OmArena {
    unsigned char* base;
    size_t size;
    size_t used;
    size_t peak;
} OmArena;"""
    base: Any
    size: int
    used: int
    peak: int


class OmRng(Struct):
    """typedef struct OmRng {
    uint32_t key[2];      // seed
    uint32_t counter[4];  // block number (2 words) and index (2 words)
    uint32_t out[4];      // the current block
    int used;             // words of `out` handed out
} OmRng;"""
    key: Numbers
    counter: Numbers
    out: Numbers
    used: int


class OmProgress(Struct):
    """typedef struct OmProgress {
    bool (*report)(void* ctx, const char* stage, double done, double total);  // false: cancel
    void* ctx;
} OmProgress;"""
    report: Any
    ctx: Any


class OmProgressBar(Struct):
    """typedef struct OmProgressBar {
    FILE* out;
    bool is_terminal;
    double start_time, last_time;  // s, of the current stage
    double last_done;              // of the last line
    char stage[64];
    int last_width;  // characters of the last line drawn
} OmProgressBar;"""
    out: Any
    is_terminal: bool
    start_time: float
    last_time: float
    last_done: float
    stage: str
    last_width: int


class OmText(Struct):
    """typedef struct OmText {
    char* str;  // always terminated once something was appended
    size_t len;
    size_t cap;
} OmText;"""
    str: bytes | None
    len: int
    cap: int


class OmJson(Struct):
    """typedef struct OmJson {
    OmText* text;
    OmStatus status;
    int depth;
    bool is_first[32];  // nothing written yet at this depth
} OmJson;"""
    text: Any
    status: Choice[OmStatus]
    depth: int
    is_first: Numbers


class OmAtomicFile(Struct):
    """typedef struct OmAtomicFile {
    char path[1024];  // links followed
    char temp[1100];  // "": a device or a pipe, written to through `stream` alone
    FILE* stream;
    int lock;  // a descriptor; while it is open, no other run takes the temporary file for left behind
} OmAtomicFile;"""
    path: str
    temp: str
    stream: Any
    lock: int


class OmFolder(Struct):
    """typedef struct OmFolder {
    char place[1024];  // where the folder is, or will be; after om_folder_commit, where it is
    char path[1100];   // where its files are written; "" once it is done with
    char kind[48];
    int lock;         // a descriptor that keeps other runs out
    bool is_growing;  // opened, not begun
    bool has_list;    // of its own, when it grows
} OmFolder;"""
    place: str
    path: str
    kind: str
    lock: int
    is_growing: bool
    has_list: bool


class OmVec3(Struct):
    """typedef struct OmVec3 {
    double x, y, z;
} OmVec3;"""
    x: float
    y: float
    z: float


class OmMat3(Struct):
    """typedef struct OmMat3 {
    OmVec3 cx, cy, cz;  // columns
} OmMat3;"""
    cx: Numbers
    cy: Numbers
    cz: Numbers


class OmQuat(Struct):
    """typedef struct OmQuat {
    double x, y, z, w;  // unit length for rotations
} OmQuat;"""
    x: float
    y: float
    z: float
    w: float


class OmPose(Struct):
    """typedef struct OmPose {
    OmVec3 p;  // m
    OmQuat q;  // frame in the name: pose_world_tool maps tool coordinates to world
} OmPose;"""
    p: Numbers
    q: Numbers


class OmGrid(Struct):
    """typedef struct OmGrid {  // cubic cells along the axes
    int dim[3];          // points
    double spacing;      // m, > 0
    OmVec3 origin;       // point (0, 0, 0), m
} OmGrid;"""
    dim: Numbers
    spacing: float
    origin: Numbers


class OmVoxelGrid(Struct):
    """typedef struct OmVoxelGrid {  // parallel steps in any direction
    int dim[3];               // voxels
    OmMat3 axis;              // columns: step of i, j, k, m; not singular
    OmVec3 origin;            // centre of voxel (0, 0, 0), m
} OmVoxelGrid;"""
    dim: Numbers
    axis: Numbers
    origin: Numbers


class OmSurface(Struct):
    """typedef struct OmSurface {  // triangles; om_surface_done frees
    int nvert, ntri;
    double* x;      // vertex positions, m                                  (nvert x 3)
    int* tri_vert;  // vertices, counter-clockwise seen from outside        (ntri x 3)
} OmSurface;"""
    nvert: int
    ntri: int
    x: Any
    tri_vert: Any


class OmMeshSet(Struct):
    """typedef struct OmMeshSet {  // a named subset of vertices: attachments, ROI, grasped patch
    char name[OM_SET_NAME];
    int nvert;
    int* vert;  // ascending, no repeats                                      (nvert)
} OmMeshSet;"""
    name: str
    nvert: int
    vert: Any


class OmTetMesh(Struct):
    """typedef struct OmTetMesh {  // linear tetrahedra; om_tet_mesh_done frees
    int nvert, ntet, nset;
    double* x;       // vertex positions, m                                  (nvert x 3)
    int* tet_vert;   // vertices; (b-a) x (c-a) . (d-a) > 0                  (ntet x 4)
    int* tet_label;  // material label of each element, 0 if there is one    (ntet)
    OmMeshSet* set;  //                                                      (nset)
} OmTetMesh;"""
    nvert: int
    ntet: int
    nset: int
    x: Any
    tet_vert: Any
    tet_label: Any
    set: Any


class OmBanetGrid(Struct):
    """typedef struct OmBanetGrid {
    OmPose pose_world_grid;  // origin at the centre of cell (0, 0, 0)
    double voxel;            // size of a cell, m: side / 64
    int dim[3];              // cells
} OmBanetGrid;"""
    pose_world_grid: OmPose
    voxel: float
    dim: Numbers


class OmMask(Struct):
    """typedef struct OmMask {     // om_mask_done frees
    OmVoxelGrid grid;       // in RAS metres
    unsigned char* inside;  // 0 or 1 for each voxel
} OmMask;"""
    grid: OmVoxelGrid
    inside: Any


class OmSdf(Struct):
    """typedef struct OmSdf {  // om_sdf_done frees
    OmGrid grid;        // of the nodes
    float* d;           // signed distance at each node, m, negative inside
} OmSdf;"""
    grid: OmGrid
    d: Any


class OmSdfDef(Struct):
    """typedef struct OmSdfDef {
    OmCookie cookie;
    double spacing;  // grid step, m, > 0; no default
    double margin;   // the grid reaches this far beyond the surface, m, >= 0; default 3 spacings
    double smooth;   // masks: width of the Gaussian, voxels, 0.5-3; default 1.2
    int iterations;  // masks: rounds of volume correction, 0-100; default 8
    // Of functions: keep their values, do not measure distances; for a contour. Default
    // false.
    bool is_raw;
    int64_t max_node;  // larger grids are refused; default 2e8
    // Of surfaces: longer distances may be too long by a fraction of a step, m, >= 0; default INFINITY.
    double exact;
    // Of surfaces: the nodes to sample, which enclose the surface; spacing and margin are not used. A
    // surface too thin to enclose a node is then no error. Borrowed; default null.
    const OmGrid* grid;
} OmSdfDef;"""
    cookie: int
    spacing: float
    margin: float
    smooth: float
    iterations: int
    is_raw: bool
    max_node: int
    exact: float
    grid: Any


class OmBsr(Struct):
    """typedef struct OmBsr {
    int nvert;       // rows of blocks
    int nedge;       // pairs i < j
    int nblock;      // nvert + 2 nedge
    int* row_adr;    // first block of each row, the diagonal one             (nvert + 1)
    int* col;        // vertex of each block                                  (nblock)
    int* edge_vert;  // vertices i < j of each edge                           (nedge x 2)
    int* edge_adr;   // its blocks (i, j) and (j, i)                          (nedge x 2)
    float* value;    // blocks by columns, then 3 floats of padding           (nblock x 9 + 3)
    double* exact;   // the same in double, or null; used by Cholesky factors  (nblock x 9)
} OmBsr;"""
    nvert: int
    nedge: int
    nblock: int
    row_adr: Any
    col: Any
    edge_vert: Any
    edge_adr: Any
    value: Any
    exact: Any


class OmSolverDef(Struct):
    """typedef struct OmSolverDef {          // made by om_solver_default_def
    OmPreconditioner preconditioner;  // default OM_MULTIGRID
    // Largest number of CG iterations in a solve, >= 1; default 200. If multigrid fails and block Jacobi continues,
    // eight of its iterations count as one; such a solve may take four times as long.
    int max_iterations;
    // Stop at |b - A x| <= tolerance |b|, in [0, 1); 0: always max_iterations. Default 1e-3.
    double tolerance;
    int nworker;  // threads, 0 is one per processor; default 0
    int max_rhs;  // right-hand sides that will share one sweep over A, 1..8; default 1
    // Of OM_MULTIGRID: an upper bound of the eigenvalues of D^-1 A, where D is the diagonal blocks.
    // Default 4, right for linear tetrahedra; the number of nodes of an element is always enough.
    double row_bound;
    OmCookie cookie;  // set by om_solver_default_def
} OmSolverDef;"""
    preconditioner: Choice[OmPreconditioner]
    max_iterations: int
    tolerance: float
    nworker: int
    max_rhs: int
    row_bound: float
    cookie: int


class OmSolveInfo(Struct):
    """typedef struct OmSolveInfo {  // what a solve did
    int iterations;           // CG iterations, the most of any right-hand side; 0 for factors
    double residual;  // |b - A x| / |b|, recomputed in double, the largest of any right-hand side
} OmSolveInfo;"""
    iterations: int
    residual: float


class OmMaterial(Struct):
    """typedef struct OmMaterial {
    double young;             // Pa, > 0; default 3000
    double poisson;           // 0 to 0.4999; default 0.45
    OmLaw law;                // default OM_COROTATIONAL
    OmVolumetric volumetric;  // default OM_VOLUME_LINEAR
    double bulk;              // K, Pa, in [0, 1e12]; 0: from young and poisson
    double c10, c01;          // Pa, in [0, 1e12], Mooney-Rivlin; both 0: mu / 2 and 0
    int nterm;  // Ogden, at most OM_MAX_OGDEN; 0: one term, mu_1 = 2 mu / alpha, alpha_1 = 2
    // mu_p, Pa, at most 1e12, and alpha_p, at most 100: of the same sign, not 0
    double ogden_mu[OM_MAX_OGDEN], ogden_alpha[OM_MAX_OGDEN];
} OmMaterial;"""
    young: float
    poisson: float
    law: Choice[OmLaw]
    volumetric: Choice[OmVolumetric]
    bulk: float
    c10: float
    c01: float
    nterm: int
    ogden_mu: Numbers
    ogden_alpha: Numbers


class OmFemMesh(Struct):
    """typedef struct OmFemMesh {  // om_fem_mesh_done frees
    OmElement kind;
    int nnode, nelem, nelem_node;  // nelem_node: 4, 10 or 8
    double* x;                     // node positions, m                          (nnode x 3)
    int* elem_node;                //                                   (nelem x nelem_node)
    int* elem_material;            // index of the material                          (nelem)
} OmFemMesh;"""
    kind: Choice[OmElement]
    nnode: int
    nelem: int
    nelem_node: int
    x: Any
    elem_node: Any
    elem_material: Any


class OmFemFaces(Struct):
    """typedef struct OmFemFaces {  // boundary faces, om_fem_faces_done frees
    int nface, nface_node;   // 3 (tet4), 6 (tet10: corners, then edges 01 12 20) or 4
    int* face_node;          // counter-clockwise seen from outside    (nface x nface_node)
    int* face_elem;          // the element behind                                 (nface)
} OmFemFaces;"""
    nface: int
    nface_node: int
    face_node: Any
    face_elem: Any


class OmFemContact(Struct):
    """typedef struct OmFemContact {
    int nface[2];
    const int* face_node[2];  // rows of om_fem_mesh_boundary; the sides share no node
    // Pa/m; 0 (default): 100 times Young's modulus over height of the softer body
    double stiffness;
    double reach;  // m, largest depth of a contact point; 0 (default): the edge of a face
} OmFemContact;"""
    nface: Numbers
    face_node: Any
    stiffness: float
    reach: float


class OmFemDef(Struct):
    """typedef struct OmFemDef {         // made by om_fem_default_def; create copies everything
    const OmFemMesh* mesh;        // borrowed until create returns
    int nmaterial;                // elem_material < nmaterial
    const OmMaterial* material;   // (nmaterial)
    const double* density;        // kg/m^3, > 0 (nmaterial); null, the default: 1000
    OmLocking locking;            // default OM_LOCKING_NONE; the others are for OM_TET4
    int ncontact;                 // default 0
    const OmFemContact* contact;  // part of the solid's energy                     (ncontact)
    bool is_projected;  // tangents of elements projected to positive semidefinite; default false
    int nworker;        // threads, 0 is one per processor; default 0
    OmCookie cookie;
} OmFemDef;"""
    mesh: Any
    nmaterial: int
    material: Any
    density: Any
    locking: Choice[OmLocking]
    ncontact: int
    contact: Any
    is_projected: bool
    nworker: int
    cookie: int


class OmFemTouch(Struct):
    """typedef struct OmFemTouch {  // on side 0 of a contact; forces on side 1 are opposite
    OmVec3 force, torque;    // N; N m about the origin
    double area;             // rest area in contact, mean of both sides, m^2
    double depth;            // of the deepest point, m
    double energy;           // J
} OmFemTouch;"""
    force: Numbers
    torque: Numbers
    area: float
    depth: float
    energy: float


class OmFemExtra(Struct):
    """typedef struct OmFemExtra {
    OmStatus (*eval)(void* ctx, const double* x, double load, double* energy, double* f, OmBsr* A);
    OmStatus (*finish)(void* ctx, const double* x, double load);  // may be null
    void* ctx;
} OmFemExtra;"""
    eval: Any
    finish: Any
    ctx: Any


class OmFemPressure(Struct):
    """typedef struct OmFemPressure {  // on faces of om_fem_mesh_boundary
    int nface, nface_node;
    const int* face_node;  // (nface x nface_node)
    OmVec3 traction;       // dead: N per m^2 of the rest area
    // Follower pressure, Pa, against the outward normal of the deformed face. On a surface with a
    // free rim the tangent is unsymmetric: UMFPACK takes the place of CHOLMOD, GMRES that of CG.
    double pressure;
} OmFemPressure;"""
    nface: int
    nface_node: int
    face_node: Any
    traction: Numbers
    pressure: float


class OmFemLoad(Struct):
    """typedef struct OmFemLoad {  // zero-initialise; values are those at load = 1
    OmVec3 body;            // force per mass, m/s^2: gravity
    const double* force;    // dead, N (nnode x 3), or null
    int npressure;
    const OmFemPressure* pressure;  // (npressure)
    const unsigned char* fixed;     // nonzero where prescribed (nnode x 3), or null
    const double* goal;             // displacement there, m (nnode x 3); null: 0
    const OmFemExtra* extra;        // or null
} OmFemLoad;"""
    body: Numbers
    force: Any
    npressure: int
    pressure: Any
    fixed: Any
    goal: Any
    extra: Any


class OmFemStaticDef(Struct):
    """typedef struct OmFemStaticDef {  // made by om_fem_static_default_def
    double load_begin;           // load factor at the start; default 0
    int nstep;                   // initial number of load steps, >= 1; default 1
    double min_step;             // a step that fails is halved, down to this; default 1/4096
    int max_newton;              // iterations of a load step, default 30
    // Of |residual| over the norm of loads and reactions, or over rounding; default 1e-9.
    double tolerance;
    bool is_plain;               // whole steps of Newton's method, no line search; default false
    OmSolverDef solver;          // default OM_CHOLESKY up to 3,000 nodes, else OM_MULTIGRID to 1e-3
    const OmProgress* progress;  // "load" from 0 to 1, at every iteration; may be null
    OmCookie cookie;
} OmFemStaticDef;"""
    load_begin: float
    nstep: int
    min_step: float
    max_newton: int
    tolerance: float
    is_plain: bool
    solver: OmSolverDef
    progress: Any
    cookie: int


class OmFemReport(Struct):
    """typedef struct OmFemReport {
    double load;         // load factor reached: 1, or less if not converged
    double residual;     // |forces at free degrees of freedom| over the norm of loads and reactions
    double force_scale;  // that norm, N
    int nstep, ncut;     // load steps made, and steps that failed and were halved
    int nnewton;         // Newton iterations in all
    int ncg;             // CG iterations in all
    double min_volume;   // smallest det F
    // The last tangent was not positive definite: the equilibrium may be unstable, as a straight column above its
    // buckling load. False where GMRES solves, because it is not known there.
    bool is_unstable;
    double history[32];  // residuals, N, of the last load step: at its start, after each iteration
    int nhistory;
    char reason[160];  // why load 1 was not reached; "" if it was
} OmFemReport;"""
    load: float
    residual: float
    force_scale: float
    nstep: int
    ncut: int
    nnewton: int
    ncg: int
    min_volume: float
    is_unstable: bool
    history: Numbers
    nhistory: int
    reason: str


class OmFemDynamicDef(Struct):
    """typedef struct OmFemDynamicDef {  // made by om_fem_dynamic_default_def
    OmIntegrator integrator;      // default OM_IMPLICIT_EULER
    bool is_consistent_mass;      // default false: lumped; OM_CENTRAL_DIFFERENCE needs lumped
    double mass_damping;          // Rayleigh's: force -mass_damping M v, 1/s, >= 0; default 0
    double min_step;     // a step that fails is halved, down to this part of h; default 1/64
    int max_newton;      // default 30
    double tolerance;    // as in statics, inertia among the loads; default 1e-9
    OmSolverDef solver;  // as in statics
    OmCookie cookie;
} OmFemDynamicDef;"""
    integrator: Choice[OmIntegrator]
    is_consistent_mass: bool
    mass_damping: float
    min_step: float
    max_newton: int
    tolerance: float
    solver: OmSolverDef
    cookie: int


class OmFemMotion(Struct):
    """typedef struct OmFemMotion {  // caller's arrays
    double* x;                // m (nnode x 3)
    double* v;                // m/s (nnode x 3); of OM_CENTRAL_DIFFERENCE: half a step earlier
    double time;              // s
} OmFemMotion;"""
    x: Any
    v: Any
    time: float


class OmBanetSampleDef(Struct):
    """typedef struct OmBanetSampleDef {  // made by om_banet_sample_default_def
    uint64_t seed;                 // no default
    OmBanetWay way;                // default OM_BANET_MIXED
    double side;                   // of the cube of 64^3 voxels, m; default 0.3
    double extent[2];     // length and width of the flat body, log-uniform, m; default 0.06-0.2
    double thickness[2];  // between the planes that clip it, log-uniform, m; default 0.007-0.02
    int max_dim[3];       // a body whose box has more cells is drawn again; default 48, 48, 16
    double share[2];      // attached part of the surface's vertices, log-uniform; default 0.05-0.5
    double visible[2];    // visible part of the surface's vertices, way (a); default 0.1-1
    double two_share;     // fraction of samples with two separate attached regions; default 0
    double board_share;   // fraction of samples that lie on a board under gravity; default 0
    OmLaw law;            // default OM_NEO_HOOKEAN
    double young[2];      // Pa; default 3000-30000
    double poisson[2];    // default 0.4-0.45
    double radius[2];     // of the grasped part of the surface, m; default 0.004-0.01
    // Strain around the gripper: force over young T sqrt(A), with the mean thickness T of the body and the grasped
    // area A; default 0.3-2.5.
    double pull[2];
    // Samples whose largest displacement is outside of this range are drawn again, m; default 0.005-0.15: an update of
    // a twin is refused below 5 mm.
    double min_u, max_u;
    double tolerance;       // of the residual, relative to the loads; default 1e-4
    double min_volume;      // smallest det F allowed in a sample; default 0.05
    int max_attempt;        // largest number of draws for one sample; default 64
    const OmTetMesh* body;  // of all samples, borrowed; null (default): random bodies
    OmCookie cookie;
} OmBanetSampleDef;"""
    seed: int
    way: Choice[OmBanetWay]
    side: float
    extent: Numbers
    thickness: Numbers
    max_dim: Numbers
    share: Numbers
    visible: Numbers
    two_share: float
    board_share: float
    law: Choice[OmLaw]
    young: Numbers
    poisson: Numbers
    radius: Numbers
    pull: Numbers
    min_u: float
    max_u: float
    tolerance: float
    min_volume: float
    max_attempt: int
    body: Any
    cookie: int


class OmBanetSample(Struct):
    """typedef struct OmBanetSample {  // om_banet_sample_done frees
    int64_t index;
    bool is_camera, has_board;
    int nregion;          // of attachments, 1 or 2
    OmMaterial material;  // young, poisson, law
    double board;  // with has_board: the body is above the plane z = board, m; gravity is along -z
    // Before the pull, as a scan would show it. On a board this is the equilibrium under gravity.
    OmTetMesh mesh;
    OmSurface surface;        // its boundary
    int* surface_vert;        // mesh vertex of each surface vertex       (surface.nvert)
    unsigned char* attached;  // surface vertices that do not move     (surface.nvert)
    unsigned char* grasped;   // surface vertices that share the force (surface.nvert)
    int center;               // surface vertex in the middle of the grasped ones
    OmVec3 force;             // resultant on the grasped vertices, N
    double* rest;           // stress-free positions, m; mesh.x unless has_board   (mesh.nvert x 3)
    double* x;              // equilibrium, m                                      (mesh.nvert x 3)
    double share, visible;  // attached and seen part of the surface's vertices
    double* u;     // displacement from mesh.x as measured, m; 0 where not seen (surface.nvert x 3)
    double* seen;  // how well each vertex was seen, 0-1       (surface.nvert)
    double max_u;  // input displacement: the largest of any vertex, exact, m
    double min_volume, residual;  // smallest det F; relative to the loads
    int nattempt, nfail;          // draws; draws whose solve failed
    int nnewton;                  // Newton iterations of the last draw
    double seconds;               // wall clock; differs between runs
} OmBanetSample;"""
    index: int
    is_camera: bool
    has_board: bool
    nregion: int
    material: OmMaterial
    board: float
    mesh: OmTetMesh
    surface: OmSurface
    surface_vert: Any
    attached: Any
    grasped: Any
    center: int
    force: Numbers
    rest: Any
    x: Any
    share: float
    visible: float
    u: Any
    seen: Any
    max_u: float
    min_volume: float
    residual: float
    nattempt: int
    nfail: int
    nnewton: int
    seconds: float


class OmBanetFacts(Struct):
    """typedef struct OmBanetFacts {  // how a sample was drawn and solved
    int index;
    int is_camera, has_board;  // 0 or 1
    int nregion;               // of attachments
    int nvert, ntet;           // of the mesh
    int nsurface, nattached;   // surface vertices; attached ones
    int nattempt, nfail;       // draws; draws whose solve failed
    double young, poisson;     // Pa
    double force;              // resultant, N
    double share, visible;     // attached and seen part of the surface vertices
    double max_u;              // largest displacement of a vertex, m
    double min_volume, residual;
    double seconds;  // wall clock; not stored
} OmBanetFacts;"""
    index: int
    is_camera: int
    has_board: int
    nregion: int
    nvert: int
    ntet: int
    nsurface: int
    nattached: int
    nattempt: int
    nfail: int
    young: float
    poisson: float
    force: float
    share: float
    visible: float
    max_u: float
    min_volume: float
    residual: float
    seconds: float


class OmBanetCells(Struct):
    """typedef struct OmBanetCells {  // om_banet_cells_done frees
    OmBanetFacts fact;
    OmBanetGrid grid;
    int ncell;            // cells with a signed distance below OM_BANET_CLIP
    int* cell;            // index in one channel of the grid, ascending  (ncell)
    int16_t* value;       // in 1/OM_BANET_UNIT       (OM_BANET_NCHANNEL x ncell)
    unsigned char* kind;  //                                              (ncell)
} OmBanetCells;"""
    fact: OmBanetFacts
    grid: OmBanetGrid
    ncell: int
    cell: Any
    value: Any
    kind: Any


class OmBanetDataDef(Struct):
    """typedef struct OmBanetDataDef {  // made by om_banet_data_default_def
    OmBanetSampleDef sample;     // default: two_share and board_share 0.15 each
    const char* out_dir;         // borrowed
    int nsample;                 // default 5000
    int first;  // samples before this one are not made, a multiple of shard; default 0
    int shard;  // samples in one file; default 50
    // Folders with parts of the same set, of the same `shard`: their files are copied, not made again. Borrowed;
    // default none.
    const char* const* part;
    int npart;
    int npicture;  // samples shown in the report; default 6
    int nworker;   // default 0: one a processor
    OmCookie cookie;
} OmBanetDataDef;"""
    sample: OmBanetSampleDef
    out_dir: bytes | None
    nsample: int
    first: int
    shard: int
    part: Any
    npart: int
    npicture: int
    nworker: int
    cookie: int


class OmBanetSummary(Struct):
    """typedef struct OmBanetSummary {
    int nsample, nmade;   // samples from def.first on; samples made by this call
    int nattempt, nfail;  // draws and failed solves of all samples
    int ncamera, nboard, ntwo;
    double median_u, max_u;  // of the largest displacement of samples, m
    double median_visible;
    int64_t ncell, nbyte;   // cells of all samples; bytes of the shards
    double seconds;         // of this call
    double sample_seconds;  // mean of the samples made by this call, wall clock of one worker
} OmBanetSummary;"""
    nsample: int
    nmade: int
    nattempt: int
    nfail: int
    ncamera: int
    nboard: int
    ntwo: int
    median_u: float
    max_u: float
    median_visible: float
    ncell: int
    nbyte: int
    seconds: float
    sample_seconds: float


class OmBanetData(Struct):
    """typedef struct OmBanetData {  // a data set in memory; om_banet_data_done frees
    int nsample;
    int first;  // index of the first sample
    uint64_t seed;
    uint64_t hash;         // of settings and seed
    double side;           // m
    OmBanetCells* sample;  // (nsample)
} OmBanetData;"""
    nsample: int
    first: int
    seed: int
    hash: int
    side: float
    sample: Any


class OmBanetView(Struct):
    """typedef struct OmBanetView {
    const double* probability;  // of being attached, by the network                    (n)
    // How well the frame shows the surroundings of each vertex, 0 to 1; null: 1 everywhere  (n)
    const double* shown;
    int grasp;   // number of the grasp; frames with one number belong together
    double age;  // s since the frame, at least 0
} OmBanetView;"""
    probability: Any
    shown: Any
    grasp: int
    age: float


class OmBanetFuseDef(Struct):
    """typedef struct OmBanetFuseDef {  // made by om_banet_fuse_default_def
    // Probability of a vertex of which no view says anything, above 0, below 1. The default, 0.275, is the mean
    // attached share of the first training samples. With 0.2, that of the present ones, medians of DSC change by less
    // than 0.01 (development shapes of the phantoms).
    double base;
    // Frames of one grasp count together as (sum of their weights)^same, 0 to 1: 0 as one, 1 as independent. Default 0.
    double same;
    double other;      // the same for grasps; default 1
    double half_life;  // s after which a frame has half of its weight; default 0: frames do not age
    double unseen;     // weight of a frame where it shows nothing, 0 to 1; default 0.3
    double limit;      // largest log-odds of a single frame, above 0; default 4
    OmCookie cookie;
} OmBanetFuseDef;"""
    base: float
    same: float
    other: float
    half_life: float
    unseen: float
    limit: float
    cookie: int


class OmNetShape(Struct):
    """typedef struct OmNetShape {  // of one sample
    int c, d, h, w;          // channels, depth, height, width (fastest), each > 0
} OmNetShape;"""
    c: int
    d: int
    h: int
    w: int


class OmLayer(Struct):
    """typedef struct OmLayer {  // fields a kind does not use are zero
    OmLayerKind kind;
    char name[OM_NET_NAME];
    int ninput;
    int input[OM_LAYER_MAX_INPUT];  // layers whose outputs are read, each before this one
    OmNetShape shape;               // of the output
    int kernel[3], stride[3];       // d, h, w
    int padding[3];                 // zeros before and behind
    int scale[3];                   // upsample
    OmActivation activation;
    float slope;         // of leaky ReLU for x < 0
    float rate;          // of dropout
    int ngroup;          // of group norm
    float epsilon;       // of norms, added to the variance
    float momentum;      // of batch norm: share of the new batch in the running statistics
    const float* mask;   // (d h w), owned by the net
    int weight, bias;    // indices of the table of parameters, or -1
    int mean, variance;  // running statistics of batch norm, or -1
} OmLayer;"""
    kind: Choice[OmLayerKind]
    name: str
    ninput: int
    input: Numbers
    shape: OmNetShape
    kernel: Numbers
    stride: Numbers
    padding: Numbers
    scale: Numbers
    activation: Choice[OmActivation]
    slope: float
    rate: float
    ngroup: int
    epsilon: float
    momentum: float
    mask: Any
    weight: int
    bias: int
    mean: int
    variance: int


class OmNetConv(Struct):
    """typedef struct OmNetConv {
    int channels;  // of the output
    int kernel[3], stride[3], padding[3];
    bool has_bias;
} OmNetConv;"""
    channels: int
    kernel: Numbers
    stride: Numbers
    padding: Numbers
    has_bias: bool


class OmUnetDef(Struct):
    """typedef struct OmUnetDef {
    OmCookie cookie;
    OmNetShape in;     // channels and grid; each extent a multiple of 4, or 2 for one level
    int out_channels;  //
    int nlevel;        // halvings of the grid, of axes that are even by then; 1 to 6, default 3
    int base_channels;  // of the first level, doubled by each; fast when a multiple of 16, default 16
    OmActivation activation;  // default OM_RELU
    float slope;              // of leaky ReLU, default 0.01
    OmLayerKind norm;         // between convolution and activation: OM_LAYER_BATCH_NORM,
                              // OM_LAYER_GROUP_NORM, or 0 for none (default)
    int ngroup;               // of group norm, default 8
    float dropout;            // rate at the bottom, default 0
    const float* mask;        // (d h w) multiplied to the output, or null (default)
} OmUnetDef;"""
    cookie: int
    in_: OmNetShape
    out_channels: int
    nlevel: int
    base_channels: int
    activation: Choice[OmActivation]
    slope: float
    norm: Choice[OmLayerKind]
    ngroup: int
    dropout: float
    mask: Any


class OmNetParameter(Struct):
    """typedef struct OmNetParameter {
    char name[OM_NET_NAME];  // "enc0.conv1.weight"
    int ndim;                // 1 to 5
    int dim[5];              // as in PyTorch; the last is fastest
    int64_t adr, num;        // its values are param[adr .. adr + num)
    int layer;
    bool is_trained;  // false for running statistics: no gradient, nothing for an optimiser to do
    bool is_decayed;  // weights of convolutions and dense layers: where weight decay belongs
} OmNetParameter;"""
    name: str
    ndim: int
    dim: Numbers
    adr: int
    num: int
    layer: int
    is_trained: bool
    is_decayed: bool


class OmNetRunDef(Struct):
    """typedef struct OmNetRunDef {
    OmCookie cookie;
    int batch;       // samples a call, > 0
    OmNetType type;  // default OM_F32
    // Keep what the backward pass needs; dropout is active, batch norm uses the batch. Default
    // false.
    bool is_training;
    bool has_input_gradient;  // backward can give the gradient of the input; default false
    int nworker;  // 0 (default): one per processor. oneDNN promises the same bytes at a fixed count
    uint64_t seed;       // of dropout, default 1
    OmNetLayout layout;  // of values between layers; the default is the faster one
} OmNetRunDef;"""
    cookie: int
    batch: int
    type: Choice[OmNetType]
    is_training: bool
    has_input_gradient: bool
    nworker: int
    seed: int
    layout: Choice[OmNetLayout]


class OmLoss_item(Struct):
    kind: Choice[OmLossKind]
    scale: float


class OmLoss(Struct):
    """typedef struct OmLoss {  // the sum of its terms
    int nterm;
    struct {
        OmLossKind kind;
        double scale;  // > 0
    } term[OM_LOSS_MAX_TERM];
    const float* weight;  // of each cell, >= 0 and not all 0 (d h w), or null; borrowed
    // Weights of each sample's own cells, >= 0, in place of `weight`; null: none. Means over cells are those of each
    // sample; a sample whose weights are all 0 adds nothing to them. (nsample x d h w), borrowed.
    const float* cell_weight;
    // Weight of each sample in means over samples, >= 0; null: all alike. Borrowed.
    const float* sample_weight;
} OmLoss;"""
    nterm: int
    term: Any
    weight: Any
    cell_weight: Any
    sample_weight: Any


class OmSchedule(Struct):
    """typedef struct OmSchedule {  // of the learning rate
    OmScheduleKind kind;
    double peak;    // > 0
    double start;   // rate of the first step, as a share of peak
    double end;     // of the last step
    double warmup;  // share of the steps that go up, [0, 1)
} OmSchedule;"""
    kind: Choice[OmScheduleKind]
    peak: float
    start: float
    end: float
    warmup: float


class OmOptimDef(Struct):
    """typedef struct OmOptimDef {
    OmCookie cookie;
    OmOptimKind kind;     // default OM_OPTIM_ADAMW
    double beta1, beta2;  // decay of the moments a step, [0, 1), default 0.9, 0.999
    double epsilon;       // added to the root of the second moment, > 0, default 1e-8
    double weight_decay;  // of entries that are is_decayed, >= 0, default 0.01
    double clip_norm;     // gradients longer than this are shortened to it; 0 (default): never
    // Decay of the exponential moving average of the weights, per step, in [0, 1); 0 (default): no
    // average.
    double average;
    int nworker;  // 0 (default): one per processor; the same bytes for any
} OmOptimDef;"""
    cookie: int
    kind: Choice[OmOptimKind]
    beta1: float
    beta2: float
    epsilon: float
    weight_decay: float
    clip_norm: float
    average: float
    nworker: int


class OmTrainGroup(Struct):
    """typedef struct OmTrainGroup {
    int rank, size;
    /// Replace each value by its mean over the ranks: the same bytes on all.
    OmStatus (*mean)(void* ctx, float* value, int64_t count);
    void* ctx;
} OmTrainGroup;"""
    rank: int
    size: int
    mean: Any
    ctx: Any


class OmTrainBatch(Struct):
    """typedef struct OmTrainBatch {
    bool is_validation;
    int epoch;              // from 0
    int count;              // samples wanted
    const int64_t* sample;  // which ones, of 0 .. ntrain - 1 or 0 .. nvalid - 1        (count)
    // Random stream of each sample in this epoch, for augmentation: om_rng_init(draw[i], ...)
    // (count)
    const uint64_t* draw;
    float* in;      // to fill: count x shape of the input
    float* target;  // to fill: count x shape of the output
    float* weight;  // of the samples in the loss, 1 unless changed (count)
    // Weights of the samples' cells in the loss, to fill: count x d h w of the output; null unless the definition
    // has_cell_weight.
    float* cell_weight;
} OmTrainBatch;"""
    is_validation: bool
    epoch: int
    count: int
    sample: Any
    draw: Any
    in_: Any
    target: Any
    weight: Any
    cell_weight: Any


class OmTrainEpoch(Struct):
    """typedef struct OmTrainEpoch {  // a row of metrics.csv
    int epoch;                 // from 1
    int64_t step;              // descents so far
    double train;              // mean loss over the epoch's batches
    double valid;              // metric over the validation samples; NaN where it was not measured
    double rate;               // of the last step
    double grad_norm;          // mean, before clipping
    double seconds;  // since the start, without the time between a stop and its resumption
} OmTrainEpoch;"""
    epoch: int
    step: int
    train: float
    valid: float
    rate: float
    grad_norm: float
    seconds: float


class OmTrainDef(Struct):
    """typedef struct OmTrainDef {
    OmCookie cookie;
    const OmNet* net;    // finished; borrowed
    OmTrainFillFn fill;  // a failure ends the training
    void* ctx;           // of fill, metric and on_epoch
    int ntrain, nvalid;  // samples; ntrain >= batch x ranks, nvalid may be 0
    int batch;  // samples a step on each rank, default 4. The rest of an epoch that fills no batch waits
    int nepoch;       // default 100
    int valid_every;  // epochs between validations, default 1; the last one always has one
    int patience;     // stop after this many validations without a better one; 0 (default): never
    OmLoss loss;      // default OM_LOSS_MSE; cell_weight and sample_weight come from `fill`
    bool has_cell_weight;  // `fill` gives a weight for every cell of every sample; default false
    OmOptimDef optim;
    OmSchedule schedule;  // over all nepoch epochs; default one cycle to 1e-3
    OmNetType type;       // of the runs, default OM_F32
    int nworker;          // 0 (default): one per processor
    uint64_t seed;        // of order, draws and dropout, default 1
    /// What validation measures, the smaller the better: the sum over `count` samples, whose numbers are in
    /// `sample`; null: the loss.
    double (*metric)(void* ctx, const int64_t* sample, const float* out, const float* target,
                     int count);
    void (*on_epoch)(void* ctx,
                     const OmTrainEpoch* row);  // after each epoch, on rank 0; may be null
    const char* dir;  // of metrics.csv and checkpoint.safetensors, made if missing; null: no files
    double checkpoint_period;   // s between checkpoints, default 60; 0: after every step
    uint64_t data_hash;         // a checkpoint of other data is refused; default 0
    const OmTrainGroup* group;  // null (default): alone
} OmTrainDef;"""
    cookie: int
    net: Any
    fill: Any
    ctx: Any
    ntrain: int
    nvalid: int
    batch: int
    nepoch: int
    valid_every: int
    patience: int
    loss: OmLoss
    has_cell_weight: bool
    optim: OmOptimDef
    schedule: OmSchedule
    type: Choice[OmNetType]
    nworker: int
    seed: int
    metric: Any
    on_epoch: Any
    dir: bytes | None
    checkpoint_period: float
    data_hash: int
    group: Any


class OmTrainResult(Struct):
    """typedef struct OmTrainResult {
    OmTrainEpoch* epoch;  // (nepoch)
    int nepoch;
    int64_t nstep;
    int best_epoch;     // whose weights were kept, from 1
    double best_value;  // its validation; NaN without validation samples
    double seconds;
    bool is_early;    // patience ran out
    bool is_resumed;  // from a checkpoint
} OmTrainResult;"""
    epoch: Any
    nepoch: int
    nstep: int
    best_epoch: int
    best_value: float
    seconds: float
    is_early: bool
    is_resumed: bool


class OmBanetTrainDef(Struct):
    """typedef struct OmBanetTrainDef {  // made by om_banet_train_default_def
    const OmBanetData* data;      // borrowed
    const char* out_dir;  // checkpoint, metrics.csv, weights.safetensors, report.html; borrowed
    const char* command;  // command line, stored in the file; may be null
    const char* start;  // file of weights of the same channels to begin with; default null: random
    int nvalid;         // number of validation samples, the last ones; default a tenth
    int channel[OM_BANET_NLEVEL];  // of the five grids, multiples of 16; default 16 32 64 96 128
    int ngroup;                    // of group norm; 0 (default): no norm
    double dropout;  // behind poolings and interpolations; default 0.1, the thesis has 0.5
    int dim[3];  // cells of the grid in training, multiples of OM_BANET_MULTIPLE; default 48 32 16
    int nimage;  // mirror images that a prediction averages, 1 to 8; default 4
    OmNetType type;     // default OM_F32; OM_BF16 is faster where the processor has it
    int batch, nepoch;  // default 32 and 40
    double rate;        // peak of the one-cycle schedule; default 7e-4
    double shell;       // weight in the loss of near cells without a vertex; default 0.25
    uint64_t seed;      // default 1
    int nworker;        // of each rank; default 0: one a processor
    // Ranks that train together, each with its part of every batch; rank 0 alone writes files. Borrowed;
    // default null.
    const OmTrainGroup* group;
    OmCookie cookie;
} OmBanetTrainDef;"""
    data: Any
    out_dir: bytes | None
    command: bytes | None
    start: bytes | None
    nvalid: int
    channel: Numbers
    ngroup: int
    dropout: float
    dim: Numbers
    nimage: int
    type: Choice[OmNetType]
    batch: int
    nepoch: int
    rate: float
    shell: float
    seed: int
    nworker: int
    group: Any
    cookie: int


class OmBanetTrainSummary(Struct):
    """typedef struct OmBanetTrainSummary {
    double dsc, tpr;  // means over the validation samples at the threshold, best epoch
    double ece;       // expected calibration error on them, which also gave the calibration
    double threshold;
    int best_epoch, nepoch;
    int64_t nstep;
    double seconds;  // of all calls
    bool is_resumed;
} OmBanetTrainSummary;"""
    dsc: float
    tpr: float
    ece: float
    threshold: float
    best_epoch: int
    nepoch: int
    nstep: int
    seconds: float
    is_resumed: bool


class OmBanetEval(Struct):
    """typedef struct OmBanetEval {  // of cells that hold a surface vertex; om_banet_eval_done frees
    int n;                    // samples
    double *dsc, *tpr;  // (4.3) and (4.6) of each sample at the threshold                     (n)
    double mean_dsc, mean_tpr;
    double dsc_quartile[3], tpr_quartile[3];  // lower, median, upper
    double bin_predicted[OM_BANET_NBIN];      // mean probability of bins of equal count, ascending
    double bin_true[OM_BANET_NBIN];           // share of attached cells in them
    double ece;  // expected calibration error: mean difference of the two
    int64_t ncell;
    double ms;  // median time of a prediction
} OmBanetEval;"""
    n: int
    dsc: Any
    tpr: Any
    mean_dsc: float
    mean_tpr: float
    dsc_quartile: Numbers
    tpr_quartile: Numbers
    bin_predicted: Numbers
    bin_true: Numbers
    ece: float
    ncell: int
    ms: float


class OmVolume(Struct):
    """typedef struct OmVolume {
    OmVoxelGrid grid;
    OmVoxelType type;  //
    void* voxel;  // values as stored, in this machine's order of bytes; of om_volume_init: float
    double slope, inter;  // value = slope * stored + inter
} OmVolume;"""
    grid: OmVoxelGrid
    type: Choice[OmVoxelType]
    voxel: Any
    slope: float
    inter: float


class OmSegment(Struct):
    """typedef struct OmSegment {       // a named part of a label map
    char name[OM_SEGMENT_NAME];  // UTF-8 without control characters; "" if the file gives none
    char id[OM_SEGMENT_NAME];    // of a .seg.nrrd, the same; "" elsewhere
    int layer;                   // the entry of the file that holds its voxels, from 0
    int value;                   // of its voxels there
} OmSegment;"""
    name: str
    id: str
    layer: int
    value: int


class OmVolumeInfo(Struct):
    """typedef struct OmVolumeInfo {  // what the header of a volume's file says; om_volume_info_done frees
    int dim[3];
    int nentry;          // volumes in the file: times, components or layers; 1 of a plain volume
    bool has_layers;     // the volumes are layers of segments that may overlap (3D Slicer)
    double unit;         // of the lengths in the header, m; 0: not stated, millimetres are taken
    bool has_space;      // the header says how the voxels lie in the patient; false: taken as RAS
    int nsegment;        //
    OmSegment* segment;  // names of .seg.nrrd (3D Slicer), or of a label table in NIfTI (nsegment)
} OmVolumeInfo;"""
    dim: Numbers
    nentry: int
    has_layers: bool
    unit: float
    has_space: bool
    nsegment: int
    segment: Any


class OmPicture(Struct):
    """typedef struct OmPicture {
    int width, height, nchannel;
    unsigned char* pixel;  // height x width x nchannel
} OmPicture;"""
    width: int
    height: int
    nchannel: int
    pixel: Any


class OmLens(Struct):
    """typedef struct OmLens {
    double fx, fy;      // focal lengths; both 0: from fov
    double cx, cy;      // principal point; both 0: the middle of the picture
    double k1, k2;      // radial
    double p1, p2, k3;  // tangential; radial
} OmLens;"""
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float


class OmCamera(Struct):
    """typedef struct OmCamera {
    OmPose pose_world_camera;
    int width, height;     // pixels, 1 to 8192
    double fov;            // vertical, rad, in (0, pi); not used where lens.fx is given
    double near_m, far_m;  // range of depth along z, m
    OmLens lens;
} OmCamera;"""
    pose_world_camera: OmPose
    width: int
    height: int
    fov: float
    near_m: float
    far_m: float
    lens: OmLens


class OmWindow(Struct):
    """typedef struct OmWindow {
    int column, row;    // of its first pixel
    int width, height;  // pixels; width 0: the whole picture
} OmWindow;"""
    column: int
    row: int
    width: int
    height: int


class OmSenseLook(Struct):
    """typedef struct OmSenseLook {
    double red, green, blue;  // 0 to 1, linear light
    double gloss;             // strength of highlights, 0 to 1: 1 is wet
    double metal;             // 0 to 1: highlights take the colour, diffuse light vanishes
    // if smooth: cosine below which a corner keeps the triangle's normal; 0: none does
    double crease;
    bool is_smooth;   // normals of vertices, not of triangles
    bool is_checker;  // squares of 10 mm in two shades, for boards
    OmSenseTexture texture;
} OmSenseLook;"""
    red: float
    green: float
    blue: float
    gloss: float
    metal: float
    crease: float
    is_smooth: bool
    is_checker: bool
    texture: Choice[OmSenseTexture]


class OmSenseRange(Struct):
    """typedef struct OmSenseRange {
    // degrees; min belongs to the range, max does not; 340 to 20 is over 0
    double hue_min, hue_max;
    double saturation_min, saturation_max;  // 0 to 1
    double value_min, value_max;            // 0 to 1
} OmSenseRange;"""
    hue_min: float
    hue_max: float
    saturation_min: float
    saturation_max: float
    value_min: float
    value_max: float


class OmSenseOptions(Struct):
    """typedef struct OmSenseOptions {
    int samples;      // rays a pixel along each side, 1 to 4: antialiasing
    bool has_shadow;  // one shadow ray a sample
    int nworker;      // 0: one a processor; the picture does not depend on it
    // The part to render; default: the whole picture. Its pixels are those of the whole picture, to the last bit if
    // `column` is a multiple of 8.
    OmWindow window;
} OmSenseOptions;"""
    samples: int
    has_shadow: bool
    nworker: int
    window: OmWindow


class OmDepthNoise(Struct):
    """typedef struct OmDepthNoise {
    double a, b;         // m and 1/m
    double min_grazing;  // 0 to 1
    double dropout;      // 0 to 1
    uint64_t seed;
    int nworker;  // 0: one a processor; the noise does not depend on it
} OmDepthNoise;"""
    a: float
    b: float
    min_grazing: float
    dropout: float
    seed: int
    nworker: int


class OmVisibility(Struct):
    """typedef struct OmVisibility {
    int npoint;    // of the region
    int nseen;     // seen
    int naway;     // their normal points away from the camera
    int noutside;  // facing it, outside its picture
    int nhidden;   // in its picture, behind something
} OmVisibility;"""
    npoint: int
    nseen: int
    naway: int
    noutside: int
    nhidden: int


class OmScan(Struct):
    """typedef struct OmScan {  // om_scan_done frees
    double time;         // s, of the exposure
    int npoint, ntri;    //
    double* x;           // world frame, m                                             (npoint x 3)
    double* normal;      // unit, towards the camera; zero: not known                  (npoint x 3)
    int* tri_vert;       // counter-clockwise seen from the camera, cut at depth jumps (ntri x 3)
    double noise;        // m, standard deviation of a point along its ray; 0: not known
    bool has_camera;     // `camera` is the camera of the picture
    OmCamera camera;
    unsigned char* pixel;  // OmScanPixel of each pixel, or null  (camera.height x camera.width)
} OmScan;"""
    time: float
    npoint: int
    ntri: int
    x: Any
    normal: Any
    tri_vert: Any
    noise: float
    has_camera: bool
    camera: OmCamera
    pixel: Any


class OmSceneTissue(Struct):
    """typedef struct OmSceneTissue {
    // Engine of the twin, by its name in OmScene.engines; default "fem". The simulated truth has finite elements.
    char engine[OM_SCENE_NAME];
    // file that this engine reads, relative to the data root; "": none
    char weights[OM_SCENE_PATH];
    int source;          // OmTissueSource
    OmVec3 size;         // m, of a sheet; default 120 x 120 x 5 mm
    OmVec3 cells;        // of the twin's sheet, default 20 x 20 x 1
    OmVec3 world_cells;  // of the simulated world's sheet; 0 (default): one and a half of `cells`
    char file[OM_SCENE_PATH];  // mesh, patient model, or volume; relative to the data root
    double unit;               // of a ready mesh, m; default 1
    OmVec3 up;    // against gravity, in the mesh's coordinates; default z; a patient has its own
    OmVec3 view;  // from the tissue towards the endoscope; default -x
    int law;      // OmLaw; default OM_STABLE_NEO_HOOKEAN
    bool is_averaged;  // OmTissueDef.is_averaged, of bodies of engine "fem"; default false
    // Coulomb's, on board and organ; default below 0: 0.35 for particles, none for others
    double friction;
    bool has_board;  // under a sheet or a mesh; default true. A patient lies on its organ instead
    double young, poisson;  // Pa and 1; default 3000 and 0.45
    double density;         // kg/m^3; default 1000
    // Modulus of the twin over that of the tissue: coarse linear elements bend too stiffly, and
    // om_body_find_mesh_factor says by how much. Default 1
    double mesh_factor;
    // A patient or a volume has materials of its own, which a scene file does not change (below 0)
    // where it says nothing. A young or density that it gives is the first material's, and the others
    // keep their ratio to it; a poisson is every material's.
    double rayleigh_mass;                    // 1/s; default 0.1
    double rayleigh_stiffness;               // s; default 0.01
    double gravity;                          // m/s^2, downwards; default 9.81
    double cluster_spacing, cluster_radius;  // of engine "pbd", m; default 12.7 and 9.5 mm
    double cluster_stiffness;                // 0 to 1; default 0.361
} OmSceneTissue;"""
    engine: str
    weights: str
    source: int
    size: Numbers
    cells: Numbers
    world_cells: Numbers
    file: str
    unit: float
    up: Numbers
    view: Numbers
    law: int
    is_averaged: bool
    friction: float
    has_board: bool
    young: float
    poisson: float
    density: float
    mesh_factor: float
    rayleigh_mass: float
    rayleigh_stiffness: float
    gravity: float
    cluster_spacing: float
    cluster_radius: float
    cluster_stiffness: float


class OmSceneModel(Struct):
    """typedef struct OmSceneModel {  // how a patient model is built from a volume; see OmModelDef
    int label;                 // of the organ in the volume
    double max_volume;         // bytes that its voxels may take; default OM_VOLUME_MAX_SIZE
    double edge;               // mean edge of the twin's mesh, m
    // Edge of the world's mesh; 0 (default): 0.7 of `edge`, or less where the world would have
    // fewer than twice the vertices of the twin.
    double world_edge;
    double thickness;                // of the sheet of fat, m
    char side[64];                   // of the organ that it covers: "anterior", "lateral", ...
    double half_length, half_width;  // m
    char attach[64];                 // attachment: "border:medial 25 %"
    double tumour_radius;            // m
    OmVec3 tumour_shift;             // along, across the sheet, m; z is not used
    // Layouts of one patient: a seed above 0 shifts the tumour by up to tumour_range either way and turns the
    // direction of `attach` by up to attach_turn either way about the covered side's. Default 0: nothing is drawn.
    OmVec3 tumour_range;  // along, across the sheet, m; z is not used
    double attach_turn;   // rad
} OmSceneModel;"""
    label: int
    max_volume: float
    edge: float
    world_edge: float
    thickness: float
    side: str
    half_length: float
    half_width: float
    attach: str
    tumour_radius: float
    tumour_shift: Numbers
    tumour_range: Numbers
    attach_turn: float


class OmSceneAttach(Struct):
    """typedef struct OmSceneAttach {
    int kind;                     // OmAttachKind
    double share_min, share_max;  // of the underside; default 0.1 to 0.5
    OmVec3 lo, hi;                // m, the box
    double stiffness;             // N/m per vertex; 0 (default) holds the vertices still
    // N/m^3: springs of this stiffness by area, in place of `stiffness`; default 0
    double foundation;
} OmSceneAttach;"""
    kind: int
    share_min: float
    share_max: float
    lo: Numbers
    hi: Numbers
    stiffness: float
    foundation: float


class OmSceneBelief(Struct):
    """typedef struct OmSceneBelief {  // attachments of the twin, where they are not those of the truth
    int kind;                   // OmBeliefKind; default OM_BELIEF_SAME
    OmVec3 shift;               // m, task frame, of OM_BELIEF_SAME; z is not used; default 0
    // m, of OM_BELIEF_SAME: the region extends by this, or shrinks if below 0; default 0
    double grow;
    // Attached vertices of OM_BELIEF_SAME over those of the truth: the region takes or loses vertices in the order of
    // D (4.1) around the vertex farthest inside it; thesis 6.5.2 has 0.2-0.6 and 1.4-1.6. Default 1.
    double ratio;
    int seed;           // of OM_BELIEF_PATCH; default 0
    double share;       // of the underside that OM_BELIEF_PATCH takes; default 0.3
    OmVec3 lo, hi;      // m, the box
    double stiffness;   // N/m per vertex, 0: held still; below 0 (default): the truth's
    double foundation;  // N/m^3, in place of `stiffness`; below 0 (default): the truth's
} OmSceneBelief;"""
    kind: int
    shift: Numbers
    grow: float
    ratio: float
    seed: int
    share: float
    lo: Numbers
    hi: Numbers
    stiffness: float
    foundation: float


class OmSceneRoiBelief(Struct):
    """typedef struct OmSceneRoiBelief {  // where the twin believes the ROI, beside its true place
    // m, task frame, along the board or the organ that carries the ROI; z is not used; default 0
    OmVec3 shift;
} OmSceneRoiBelief;"""
    shift: Numbers


class OmSceneRegistration(Struct):
    """typedef struct OmSceneRegistration {
    OmVec3 shift;  // m, task frame; default 0
    OmVec3 turn;   // rad, rotation vector in the task frame, about its origin; default 0
} OmSceneRegistration;"""
    shift: Numbers
    turn: Numbers


class OmSceneRoi(Struct):
    """typedef struct OmSceneRoi {
    bool is_random;  // anywhere free under the tissue; default true
    OmVec3 center;   // m, task frame, if not random
    double radius;   // m; default 8 mm
    double margin;   // m, from the border of the tissue and from attachments; default 5 mm
} OmSceneRoi;"""
    is_random: bool
    center: Numbers
    radius: float
    margin: float


class OmSceneCamera(Struct):
    """typedef struct OmSceneCamera {
    double distance;    // m from the task frame's origin
    double elevation;   // rad above the horizontal
    double fov;         // rad, vertical; not used where focal is given
    int width, height;  // pixels
    // Of a calibrated camera, as OpenCV and ROS write it: the centre of the first pixel is (0, 0).
    double focal[2];       // fx, fy, pixels; default 0: from fov
    double center[2];      // principal point cx, cy, pixels; default 0: the middle of the picture
    double distortion[5];  // k1, k2, p1, p2, k3; default 0
} OmSceneCamera;"""
    distance: float
    elevation: float
    fov: float
    width: int
    height: int
    focal: Numbers
    center: Numbers
    distortion: Numbers


class OmSceneWorld(Struct):
    """typedef struct OmSceneWorld {  // what the simulated world hides from the twin
    double young_factor;       // true Young's modulus over `young`; default 0.85
    double density_factor;     // default 1
    int law;                   // OmLaw of the true tissue, -1 (default): the twin's
    double poisson;        // true Poisson's ratio of all materials, below 0 (default): the twin's
    double friction;       // true friction, below 0 (default): the twin's
    double tool_noise;     // m, standard deviation of a measured tool position; default 0.2 mm
    bool has_depth_noise;  // default true
    int narm;              // 1 (PSM1 alone) to OM_MAX_ARM; default 2
    // N, standard deviation of a measured force at the tip along each axis; default below 0: arms measure no force
    double force_noise;
    // A grasp slips where the force on the jaws exceeds grip_friction x grip_force: the tissue is free, and the jaws
    // close on nothing. Coulomb's friction; default below 0: no grasp slips.
    double grip_friction;
    double grip_force;  // N, of the jaws on the tissue; default 8
    // Pa: an attached vertex tears off for good where the force of its attachment exceeds this times its area
    // (OmSite.attach_area); default 0: nothing tears
    double tear_strength;
} OmSceneWorld;"""
    young_factor: float
    density_factor: float
    law: int
    poisson: float
    friction: float
    tool_noise: float
    has_depth_noise: bool
    narm: int
    force_noise: float
    grip_friction: float
    grip_force: float
    tear_strength: float


class OmSceneTask(Struct):
    """typedef struct OmSceneTask {
    int grid;  // N of the N x N grasping points, 2 to OM_SCENE_MAX_GRID; default 5
    // epsilon of Alg. 4, N; calibrated for each scene. Default 2.55, the sheet's.
    double force_threshold;
    // The arms slow down and stop by the twin's force; default true. False: no force limit, for twins whose engine has
    // no forces in newtons (OM_ENGINE_FORCES).
    bool watch_force;
    // N: by how much the force on the true tissue may exceed the twin's estimate. The arms act at
    // force_threshold less this. Calibrated for each scene; default 0.
    double force_margin;
    double max_height;  // m; default 50 mm
    double pull_step;   // m; default 10 mm
    double visibility;  // share that counts as exposed; default 0.8
    // A motion ends where the ROI is visible by this share more: `visibility` is the least that is
    // wanted, 1 less `visibility` asks for all of it. Default 0.05
    double visibility_margin;
    double speed;         // m/s; default 20 mm/s
    double grasp_radius;  // m; default 5 mm
    double time_step;     // s; default 0.02
    int max_actions;      // default 150
    // m: length of a fold, away from the camera or beyond the ROI. Beyond it a fold continues only
    // while visibility increases. Default 100 mm.
    double retract;
    // rad: by which the wrist may turn, from the orientation of the parked tool, where a joint forbids a motion with
    // it; 0: never, as in the thesis. Default 45 degrees.
    double wrist_turn;
    // Grasping points tried in the twin before a new plan during the operation, 0 to 16: look ahead. Default 0.
    int ahead;
} OmSceneTask;"""
    grid: int
    force_threshold: float
    watch_force: bool
    force_margin: float
    max_height: float
    pull_step: float
    visibility: float
    visibility_margin: float
    speed: float
    grasp_radius: float
    time_step: float
    max_actions: int
    retract: float
    wrist_turn: float
    ahead: int


class OmSceneUpdate(Struct):
    """typedef struct OmSceneUpdate {  // attachments of the twin corrected during the operation
    bool is_enabled;            // default false
    // s from the start of an estimate to its adoption in a simulated world, whatever time it took; default 0.6, as
    // an estimate of three views takes 0.4 to 0.55 s
    double latency;
    int keep;  // acquisitions of different grasps in one estimate, 1 to OM_UPDATE_MAX_KEEP; default 3
    double min_lift;  // m, tissue lifted less is not looked at; default 10 mm
    double rest;      // s that the arms keep still before the picture; default 0.3
    // weights of BA-Net that an estimate asks: "none" (default), "installed", or a file
    char network[OM_SCENE_PATH];
    // An estimate is adopted only if the updated twin is closer to what the camera sees; default true.
    bool is_checked;
    // Young's modulus of the twin is learnt from measured pulls (defras_modulus.h), also where is_enabled is false. It
    // needs arms that measure force; default false.
    bool learns_modulus;
    // The same from the shape that the depth camera sees in pulls (defras_modulus_shape.c). It needs the monitor;
    // default false, `omentum retract --defras` sets it.
    bool learns_modulus_by_shape;
} OmSceneUpdate;"""
    is_enabled: bool
    latency: float
    keep: int
    min_lift: float
    rest: float
    network: str
    is_checked: bool
    learns_modulus: bool
    learns_modulus_by_shape: bool


class OmSceneMonitor(Struct):
    """typedef struct OmSceneMonitor {  // the twin compared with the depth camera during the operation
    bool is_enabled;             // default false
    // m, discrepancy above which the warning state is 1, 2 and 3; above 0, ascending; default 2, 4 and 6 mm
    double limit[3];
    double hysteresis;  // m, by which it must fall below a limit; below limit[0]; default 0.5 mm
    double rate;        // frames a second; default 30
    int npoint;         // measured points in a frame, at most; default 1000
    // Share of the measured points that are nearer to the twin than a frame's distance; default 0.5, the median of
    // thesis 6.4.5. A larger share notices disagreement of a smaller part of the tissue, and gives more false alarms.
    double quantile;
    int region;  // OmMonitorRegion; default OM_MONITOR_TISSUE
    // m, of OmMonitorFrame.part, above which the state is 1 and 2 in a pull; ascending, or both 0: parts of the tissue
    // are not watched. Default 4 and 8 mm. Ours, not in the thesis.
    double part_limit[2];
    double part_share;  // of the measured points, that make a part; default 0.02
    // On limit[] while tissue is held that was folded since its grasp, 1 or more; default 2, 1: Alg. 5. Ours: a fold
    // tips over at another moment than in the twin.
    double fold_factor;
    // State 1 of a fold is judged when it has ended and the tissue rests, not while it moves; default true. Folded
    // tissue tips over at another moment than in the twin. Ours; false: Alg. 5.
    bool is_fold_at_rest;
} OmSceneMonitor;"""
    is_enabled: bool
    limit: Numbers
    hysteresis: float
    rate: float
    npoint: int
    quantile: float
    region: int
    part_limit: Numbers
    part_share: float
    fold_factor: float
    is_fold_at_rest: bool


class OmScene(Struct):
    """typedef struct OmScene {
    // Engines that `tissue: engine` may name, borrowed; null (default): om_engine_set_default of body.h.
    const struct OmEngineSet* engines;
    char name[OM_SCENE_NAME];
    char path[OM_SCENE_PATH];       // the file it came from
    char data_root[OM_SCENE_PATH];  // files are relative to it; default: the scene's folder
    // values that replace the scene's own, as `omentum calibrate` leaves
    char calibrated[OM_SCENE_PATH];
    // them; relative to the scene's folder; "": none
    int seed;  // of attachments, ROI and noise; --layout sets it
    OmSceneTissue tissue;
    OmSceneModel model;
    OmSceneAttach attach;              // the truth
    OmSceneBelief believed;            // by the twin
    OmSceneRoiBelief believed_roi;     //
    OmSceneRegistration registration;  //
    OmSceneRoi roi;
    OmSceneCamera endoscope, rgbd;
    OmSceneWorld world;
    OmSceneTask task;
    OmSceneUpdate update;
    OmSceneMonitor monitor;
} OmScene;"""
    engines: Any
    name: str
    path: str
    data_root: str
    calibrated: str
    seed: int
    tissue: OmSceneTissue
    model: OmSceneModel
    attach: OmSceneAttach
    believed: OmSceneBelief
    believed_roi: OmSceneRoiBelief
    registration: OmSceneRegistration
    roi: OmSceneRoi
    endoscope: OmSceneCamera
    rgbd: OmSceneCamera
    world: OmSceneWorld
    task: OmSceneTask
    update: OmSceneUpdate
    monitor: OmSceneMonitor


class OmSiteMaterial(Struct):
    """typedef struct OmSiteMaterial {  // a patient's own, by the mesh's tet_label
    char name[64];
    double young, poisson, density;  // Pa, 1, kg/m^3
} OmSiteMaterial;"""
    name: str
    young: float
    poisson: float
    density: float


class OmSite(Struct):
    """typedef struct OmSite {
    OmSiteRole role;  //
    // world frame; sets "underside", "top", "attachment" (of the twin: as believed)
    OmTetMesh mesh;
    double attach_stiffness;   // N/m, of the spring of each attached vertex; 0: held still
    double attach_foundation;  // N/m^3; above 0: attach_spring holds instead
    double* attach_area;       // m^2, share of each vertex of the set "attachment", in its order
    double* attach_spring;     // N/m, of each of them
    OmPose pose_world_task;    // task frame
    // Frame by which the scene places cameras and arms: the task frame, but without the error of registration.
    OmPose pose_world_field;
    OmVec3 half_size;   // m, half the extent of the tissue in the task frame
    bool has_ground;    // a board at the task frame's z = 0
    bool has_organ;     // still anatomy under the tissue
    OmSurface organ;    //
    OmSdf organ_sdf;    //
    int nroi;           // sample points of the ROI's surface
    double* roi_x;      // world frame, m      (nroi x 3)
    double* roi_n;      // outward normals     (nroi x 3)
    OmSurface roi;      // to be drawn
    OmVec3 roi_center;  // world frame, m
    int nmaterial;      // of a patient; 0: all of the tissue is of one
    OmSiteMaterial material[OM_SITE_MATERIALS];
    double young, density;  // of this site's tissue, or its first material, Pa and kg/m^3
    double poisson;         // of all of it; below 0: each material's own
    OmVec3 gravity;         // world frame, m/s^2
} OmSite;"""
    role: Choice[OmSiteRole]
    mesh: OmTetMesh
    attach_stiffness: float
    attach_foundation: float
    attach_area: Any
    attach_spring: Any
    pose_world_task: OmPose
    pose_world_field: OmPose
    half_size: Numbers
    has_ground: bool
    has_organ: bool
    organ: OmSurface
    organ_sdf: OmSdf
    nroi: int
    roi_x: Any
    roi_n: Any
    roi: OmSurface
    roi_center: Numbers
    nmaterial: int
    material: Any
    young: float
    density: float
    poisson: float
    gravity: Numbers


class OmMatchDef(Struct):
    """typedef struct OmMatchDef {  // made by om_match_default_def
    const OmScene* scene;    // law of the tissue, radius of a grasp; borrowed
    const OmSite* site;      // of role OM_SITE_TWIN; borrowed until destroy
    int ncandidate;
    // vertices that may be attached; copied; null (default): the set "underside", else the surface  (ncandidate)
    const int* candidate;
    // N/m^3, stiffness by area of a full attachment; default 0: 20 times Young's modulus over the mean edge
    double foundation;
    double contact;   // N/m^3, penalty of board and organ; default 0: as foundation
    int nhypothesis;  // random patches of the prior, 0 to 20,000; default 2000
    uint64_t seed;    // of these patches; default 1
    // m, displacement of a candidate above which it counts as moved; default 2.5 mm
    double moved;
    // An update is refused below this seen share of the candidates' area; default 0.1
    double min_seen;
    // ... below this displacement of the grasp, m; default 5 mm
    double min_motion;
    // ... above this median distance of the scan from the updated twin, m; default 4 mm
    double max_residual;
    // Adopt an estimate without asking whether the updated twin is closer to the scan; default false. For comparisons.
    bool is_unchecked;
    int nworker;  // threads; default 1
    OmCookie cookie;
} OmMatchDef;"""
    scene: Any
    site: Any
    ncandidate: int
    candidate: Any
    foundation: float
    contact: float
    nhypothesis: int
    seed: int
    moved: float
    min_seen: float
    min_motion: float
    max_residual: float
    is_unchecked: bool
    nworker: int
    cookie: int


class OmMatchView(Struct):
    """typedef struct OmMatchView {   // constant, valid until om_match_destroy
    const OmTetMesh* mesh;     // of the site
    const OmSurface* surface;  // boundary in the rest shape
    const int* surface_vert;   // vertex of the mesh of each vertex of `surface`
    const int* surface_of;     // the reverse, -1: inside                       (mesh->nvert)
    int ncandidate;
    const int* candidate;  // vertices of the mesh, ascending                   (ncandidate)
    const double* area;    // m^2, share of each candidate                      (ncandidate)
    double edge;           // m, mean edge of the surface
    double foundation;     // N/m^3, stiffness by area of a full attachment
} OmMatchView;"""
    mesh: Any
    surface: Any
    surface_vert: Any
    surface_of: Any
    ncandidate: int
    candidate: Any
    area: Any
    edge: float
    foundation: float


class OmMatchGrasp(Struct):
    """typedef struct OmMatchGrasp {
    int arm;
    OmPose pose_world_grasp;  // tip when the jaw closed
    OmPose pose_world_now;
    double radius;  // m; 0: of the scene
    int nvert;
    // grasped vertices of the twin; null: those within `radius` of pose_world_grasp in the rest shape  (nvert).
    // A vertex of two grasps follows the first one. The tissue was at rest where it was grasped: om_match_update
    // refuses a grasp of displaced tissue.
    const int* vert;
} OmMatchGrasp;"""
    arm: int
    pose_world_grasp: OmPose
    pose_world_now: OmPose
    radius: float
    nvert: int
    vert: Any


class OmMatchPull(Struct):
    """typedef struct OmMatchPull {
    int tri;         // of OmMatchView.surface
    double bary[3];  // weights of its vertices
    OmVec3 goal;     // m
    OmVec3 normal;   // unit; zero if `across` is 0
    double across;   // N/m, along the normal
    double along;    // N/m, in every direction
} OmMatchPull;"""
    tri: int
    bary: Numbers
    goal: Numbers
    normal: Numbers
    across: float
    along: float


class OmMatchLoad(Struct):
    """typedef struct OmMatchLoad {  // zero-initialise
    const double* spring;  // N/m, of each candidate to its rest position; null: none  (ncandidate)
    int ngrasp;
    const OmMatchGrasp* grasp;  // grasped vertices follow the tool
    int npull;
    const OmMatchPull* pull;
    int max_newton;    // default 0: 60
    double tolerance;  // m, of the largest displacement in an iteration; default 0: 1e-5
} OmMatchLoad;"""
    spring: Any
    ngrasp: int
    grasp: Any
    npull: int
    pull: Any
    max_newton: int
    tolerance: float


class OmMatchRest(Struct):
    """typedef struct OmMatchRest {
    int nnewton;      // iterations
    double motion;    // m, largest displacement of a vertex in the last iteration
    double residual;  // N, largest unbalanced force on a vertex
    double energy;    // J
} OmMatchRest;"""
    nnewton: int
    motion: float
    residual: float
    energy: float


class OmAcquisition(Struct):
    """typedef struct OmAcquisition {
    OmScan scan;
    int ngrasp;
    OmMatchGrasp grasp[OM_MAX_ARM];
    double time;  // s
    // the twin's vertex positions at that time, m; null: at rest under the grasps, with the attachments of the site
    // (mesh->nvert x 3)
    const double* x_twin;
    // Nonzero where the twin is attached at that time; null: not told. om_banet_update believes the newest.  (nvert)
    const unsigned char* attached;
} OmAcquisition;"""
    scan: OmScan
    ngrasp: int
    grasp: Any
    time: float
    x_twin: Any
    attached: Any


class OmMatchEstimate(Struct):
    """typedef struct OmMatchEstimate {  // om_match_estimate_done frees
    int nvert;                    // of the mesh
    double* probability;          // of being attached; 0 where no candidate        (nvert)
    // 0: scans and advice decide; 1: they say nothing about this vertex             (nvert)
    double* uncertainty;
    double* stiffness;  // N/m, of the spring of each attached vertex          (nvert)
    // the set with the largest expected Dice coefficient, or the set that `choice` names  (nvert)
    unsigned char* attached;
    int nacquisition;
    double* x;  // the twin at rest with these attachments, m  (nacquisition x nvert x 3)
    // The twin brought onto the newest scan by springs, with its present mechanics; has_shape: it is clearly nearer
    // than before, whether attachments explain the scan or not
    bool has_shape;
    double* shape;        // m  (nvert x 3)
    double shape_median;  // m, distance of the points of all scans from their shapes
    double seen_share;    // of the candidates' area, below which the scans show the surface
    double moved_share;   // of the candidates' area, that the scans show as moved
    // m, distances of scan points from the twin: as believed before, and with these attachments
    double before_median, before_p90, after_median, after_p90;
    double before_mean, after_mean;  // m, the same, of distances that count 5 mm at most
    // 0: `attached` is the most probable set; 1: that of the scans alone; 2 + k: set k of the advice; 2 + nset: the
    // corrected `present`
    int choice;
    bool is_accepted;
    char reason[256];  // why not; "" if accepted
    // centroid of the vertices about which the scans say least: a grasp or view there informs most
    bool has_look_next;
    OmVec3 look_next;
    double fit_ms, infer_ms, check_ms, total_ms;  // times of the stages
} OmMatchEstimate;"""
    nvert: int
    probability: Any
    uncertainty: Any
    stiffness: Any
    attached: Any
    nacquisition: int
    x: Any
    has_shape: bool
    shape: Any
    shape_median: float
    seen_share: float
    moved_share: float
    before_median: float
    before_p90: float
    after_median: float
    after_p90: float
    before_mean: float
    after_mean: float
    choice: int
    is_accepted: bool
    reason: str
    has_look_next: bool
    look_next: Numbers
    fit_ms: float
    infer_ms: float
    check_ms: float
    total_ms: float


class OmMatchAdvice(Struct):
    """typedef struct OmMatchAdvice {  // zero-initialise
    // of being attached, of each vertex of the mesh; null: not known               (nvert)
    const double* probability;
    double weight;  // of `probability` against the random patches of the prior, 0 to 1
    // sets to try beside the most probable one, nonzero where attached             (nset x nvert)
    int nset;  // at most OM_MATCH_MAX_ADVICE
    const unsigned char* set[OM_MATCH_MAX_ADVICE];
    // Attachments that the twin has; null: not known. One set more is tried: these, attached where the scans show that
    // tissue stayed and the twin moved it, and free where they show that it moved              (nvert)
    const unsigned char* present;
} OmMatchAdvice;"""
    probability: Any
    weight: float
    nset: int
    set: Any
    present: Any


class OmMatchTrial(Struct):
    """typedef struct OmMatchTrial {
    double median, p90;  // m, distances of scan points from the twin
    double mean;         // m, with each distance at most 5 mm
    bool is_at_rest;
} OmMatchTrial;"""
    median: float
    p90: float
    mean: float
    is_at_rest: bool


class OmBanetUpdateDef(Struct):
    """typedef struct OmBanetUpdateDef {  // made by om_banet_update_default_def
    OmMatch* match;                // borrowed until destroy; used in om_banet_update
    const OmBanetNet* net;         // borrowed until destroy; null (default): none
    double side;                   // of its grid, m; default: om_banet_default_side
    // in place of `net`; null (default): none. With neither, the estimate is that of physics alone.
    OmBanetEstimateFn estimate;
    void* estimate_ctx;   // borrowed until destroy
    OmBanetFuseDef fuse;  // of several views
    double threshold;     // of the network's set; default 0: that of `net`, else 0.5
    double weight;        // of the network against the random patches, 0 to 1; default 0.7
    // m, a vertex at this distance from the nearest seen one is shown by half; default 15 mm
    double reach;
    // Sets that are tried in the twin besides the most probable one and that of the scans alone, 0 to 4, in this order:
    // the network's at its threshold, the last accepted one, the network's at 0.4 and 2.5 times the odds; default 2
    int ntry;
    // The correspondence goes through the twin that physics alone has corrected, where that is accepted: one more
    // om_match_update, for a twin that has few of its attachments. Default false.
    bool is_corrected;
    // One more set is tried: the last accepted one, corrected where twin and scans contradict each other
    // (OmMatchAdvice.present). Default false; om_retract_run sets it.
    bool tries_last_corrected;
    int nworker;  // threads of the correspondence; default 1
    OmCookie cookie;
} OmBanetUpdateDef;"""
    match: Any
    net: Any
    side: float
    estimate: Any
    estimate_ctx: Any
    fuse: OmBanetFuseDef
    threshold: float
    weight: float
    reach: float
    ntry: int
    is_corrected: bool
    tries_last_corrected: bool
    nworker: int
    cookie: int


class OmBanetAdvice(Struct):
    """typedef struct OmBanetAdvice {  // what the network said; om_banet_advice_done frees
    int nvert;                  // of the mesh
    int nacquisition;
    // by the network from each acquisition; 0: inside, or no correspondence    (nacquisition x nvert)
    double* view;
    double* probability;  // of all views; 0 inside                                     (nvert)
    int nused;            // acquisitions from which the network said something
    char reason[256];     // why not from all; "" if from all, or without a network
    double pairs_ms, network_ms;  // times of correspondence and network, of all acquisitions
    double total_ms;              // of the whole update
} OmBanetAdvice;"""
    nvert: int
    nacquisition: int
    view: Any
    probability: Any
    nused: int
    reason: str
    pairs_ms: float
    network_ms: float
    total_ms: float


class OmMatchLiveDef(Struct):
    """typedef struct OmMatchLiveDef {  // made by om_match_live_default_def
    const OmMatch* match;        // borrowed until destroy; only its constant part is used
    int nfollow;  // iterations towards the tool's pose without the scan, 0 to 100; default 10
    int nfit;     // iterations with the scan, 1 to 100; default 5
    // Stiffness of the springs to the scan over that of the tissue, per vertex of the surface, > 0; default 1.
    double fit_stiffness;
    double along;  // share of this stiffness along the surface, 0 to 1; default 0.01
    // m, displacement at which an attachment has a quarter of its stiffness; default 3 mm
    double release;
    double max_distance;  // m, of a pair, in iterations; default 30 mm
    double min_cosine;    // between the normals of a pair, -1 to 1; default 0.3
    // The result is lost if the median distance of pairs is above this and above three times the noise, m; default 1 mm
    double max_median;
    double max_p95;     // ... if the distance of 5 % of the pairs is; default 3 mm
    double min_paired;  // ... if less than this share of the points has a partner; default 0.6
    // ... if the camera sees something else than tissue in more than this share of the twin's view; default 0.06
    double max_empty;
    // Steps along the tool's way in a restart from the rest shape, after a lost result; 0: no restart. Default 12.
    int nrestart;
    int nworker;  // threads; default 1
    OmCookie cookie;
} OmMatchLiveDef;"""
    match: Any
    nfollow: int
    nfit: int
    fit_stiffness: float
    along: float
    release: float
    max_distance: float
    min_cosine: float
    max_median: float
    max_p95: float
    min_paired: float
    max_empty: float
    nrestart: int
    nworker: int
    cookie: int


class OmMatchPairs(Struct):
    """typedef struct OmMatchPairs {  // om_match_pairs_done frees
    int npoint;                // of the scan
    int* tri;        // triangle of OmMatchView.surface of each point, -1: none    (npoint)
    double* bary;    // weights of its vertices                                    (npoint x 3)
    double* weight;  // trust, 0 to 1; 0 without partner                           (npoint)
    double* x_rest;  // the material point in the rest shape, m; NaN without one   (npoint x 3)
    int nvert;       // of the mesh
    double* x;       // the twin deformed onto the scan, m                         (nvert x 3)
    double median, p90, p95;  // m, distances of points with a partner from that surface
    double paired;            // share of points with a partner
    double empty;       // share of the twin's view where the camera sees no tissue; 0: not known
    bool is_restarted;  // lost from x_twin; this result is of a restart
    bool is_lost;       // do not use the pairs
    char reason[256];   // why lost; "" if not
    double ms;          // time of the call
} OmMatchPairs;"""
    npoint: int
    tri: Any
    bary: Any
    weight: Any
    x_rest: Any
    nvert: int
    x: Any
    median: float
    p90: float
    p95: float
    paired: float
    empty: float
    is_restarted: bool
    is_lost: bool
    reason: str
    ms: float


class OmTissueDef(Struct):
    """typedef struct OmTissueDef {              // made by om_tissue_default_def
    const struct OmTissueEngine* engine;  // by om_tissue_default_def; borrowed, a constant table
    // Options of the engine: OmPbdDef, OmChainDef, OmUmeshNet ...; null (default): the engine's defaults. Each engine's
    // header says whether it copies or borrows them.
    const void* options;
    // Instead of `options`: a file and numbers from which the engine makes options, owned by the model; default null
    const struct OmEngineInput* input;
    const OmTetMesh* mesh;  // copied by create
    int nmaterial;  // tet_label must be below it; default 0: every label has `material_default`
    const OmMaterial* material;   // by tet_label                                  (nmaterial)
    OmMaterial material_default;  // used if nmaterial is 0
    double density;               // kg/m^3, > 0; default 1000
    // kg/m^3 by tet_label, in place of `density`; null (default): `density` everywhere
    // (nmaterial)
    const double* material_density;
    double rayleigh_mass;       // 1/s, >= 0; default 0.1
    double rayleigh_stiffness;  // s, >= 0; default 0
    OmVec3 gravity;             // m/s^2; default (0, 0, -9.81)
    // N/m, stiffness of the spring at each vertex of the set "attachment"; default 0: fixed. A state may change it.
    double attachment_stiffness;
    // N/m, a stiffness for each vertex of the set, in the set's order, instead of attachment_stiffness; copied; null
    // (default): all equal
    const double* attachment_springs;
    int max_newton;  // 1: one linearisation (thesis (3.5)); > 1: maximum of Newton's iterations; default 1
    double newton_tolerance;  // relative to the residual at the first linearisation; default 1e-3
    // For om_fem_engine: average strains around vertices, which prevents locking (doc/fem.md). Default false.
    bool is_averaged;
    OmSolverDef solver;  // max_iterations, tolerance, nworker ...; default as om_solver_default_def
    OmCookie cookie;     // set by om_tissue_default_def
} OmTissueDef;"""
    engine: Any
    options: Any
    input: Any
    mesh: Any
    nmaterial: int
    material: Any
    material_default: OmMaterial
    density: float
    material_density: Any
    rayleigh_mass: float
    rayleigh_stiffness: float
    gravity: Numbers
    attachment_stiffness: float
    attachment_springs: Any
    max_newton: int
    newton_tolerance: float
    is_averaged: bool
    solver: OmSolverDef
    cookie: int


class OmTissueReport(Struct):
    """typedef struct OmTissueReport {
    int iterations;          // CG iterations of all substeps and solves; 0 for a direct solver
    double residual;         // |b - A x| / |b|, recomputed in double; the worst
    int substeps;            // 1 unless the step had to be cut
    int newton;              // iterations of Newton's method; 0 where one linearisation did
    double newton_residual;  // relative to the residual at the first linearisation
    int ninverted;  // elements with det F <= 1e-6 at the end; counted by finite elements only
    // J, largest rise of energy in a substep beyond the work done and rounding.
    double energy_gain;
    // An accepted substep crushes an element or gains energy; of a network: the input is unlike its training data.
    bool is_unguarded;
} OmTissueReport;"""
    iterations: int
    residual: float
    substeps: int
    newton: int
    newton_residual: float
    ninverted: int
    energy_gain: float
    is_unguarded: bool


class OmTissueObstacle(Struct):
    """typedef struct OmTissueObstacle {
    OmDistanceFn distance;
    const void* ctx;    // borrowed
    double offset;      // m, distance that is kept from the surface
    double thickness;   // m, a path is checked in pieces shorter than half of it; 0: one piece
    bool is_plane;      // the distance is linear in p
    bool has_bounds;    // lo and hi are set
    OmVec3 lo, hi;      // box around the obstacle, in its frame
    OmPose pose_begin;  // pose_world_obstacle at the beginning of the step
    OmPose pose_end;    // the same at its end
    double friction;    // Coulomb's; negative: of the contact, or of the engine
    // computed by the step
    // N, N m on the tissue; torque about pose_end.p. The mean over the step for engines that move vertices
    // themselves, else of the last substep.
    OmVec3 force, torque;
    int ncontact;        // vertices pushed in the last substep
    double penetration;  // m, largest of these vertices after the step
} OmTissueObstacle;"""
    distance: Any
    ctx: Any
    offset: float
    thickness: float
    is_plane: bool
    has_bounds: bool
    lo: Numbers
    hi: Numbers
    pose_begin: OmPose
    pose_end: OmPose
    friction: float
    force: Numbers
    torque: Numbers
    ncontact: int
    penetration: float


class OmTissueForces(Struct):
    """typedef struct OmTissueForces {  // N, resultants of forces on the tissue
    OmVec3 grasp[OM_MAX_ARM];    // by each tool, from the constrained rows of the last step
    OmVec3 pull[OM_MAX_ARM];     // grasp minus the weight of the grasped patch
    OmVec3 attachment;           // by the attachments, from element stresses (or their springs)
    OmVec3 contact;              // by ground and organs, from the last contact step
    OmVec3 external;             // om_tissue_external_force
    OmVec3 weight;               // of all tissue
} OmTissueForces;"""
    grasp: Any
    pull: Any
    attachment: Numbers
    contact: Numbers
    external: Numbers
    weight: Numbers


class OmTissueEnergy(Struct):
    """typedef struct OmTissueEnergy {  // J
    double elastic, kinetic, gravity, spring;
} OmTissueEnergy;"""
    elastic: float
    kinetic: float
    gravity: float
    spring: float


class OmEmbedding(Struct):
    """typedef struct OmEmbedding {  // points carried by elements; om_embedding_done frees
    int npoint;
    int* tet;       // element that carries each point, -1 for particles         (npoint)
    double* bary;   // barycentric coordinates, any sign outside the mesh        (npoint x 4)
    int* tet_vert;  // its vertices, or the particles                            (npoint x 4)
} OmEmbedding;"""
    npoint: int
    tet: Any
    bary: Any
    tet_vert: Any


class OmAssembly(Struct):
    """typedef struct OmAssembly {
    const double *x, *v;  // (nvert x 3)
    double mass;          // of masses: 1 + h a, 0 in statics
    double stiffness;     // of K: h^2 + h b
    double force;         // of all forces: h
    double lag;           // s, of elastic forces: h + b
    double spring;        // of the springs of attachments: h^2
    double spring_lag;    // s, of their forces: h
    bool is_exact;        // exact tangent; otherwise its negative eigenvalues are set to zero
    bool is_turned;       // use the corotational law with the same constants: a predictor
} OmAssembly;"""
    x: Any
    v: Any
    mass: float
    stiffness: float
    force: float
    lag: float
    spring: float
    spring_lag: float
    is_exact: bool
    is_turned: bool


class OmTissueCheck(Struct):
    """typedef struct OmTissueCheck {  // what a step does to the elements
    int ncrushed;               // flattened or inverted beyond the limit of a step
    int nbarrier;               // crushed elements with a law whose energy is infinite at det F = 0
    int ninverted;              // det F <= 0 at its end
    double elastic_begin;       // J, in floats: off by about 1e-7 of sum V mu
    double elastic_end;
} OmTissueCheck;"""
    ncrushed: int
    nbarrier: int
    ninverted: int
    elastic_begin: float
    elastic_end: float


class OmEngineNumber(Struct):
    """typedef struct OmEngineNumber {
    const char* name;  // a key of a scene's tissue without its unit: "cluster_spacing"
    double value;      // SI
} OmEngineNumber;"""
    name: bytes | None
    value: float


class OmEngineInput(Struct):
    """typedef struct OmEngineInput {  // what a scene or a caller gives to `load`
    const char* file;           // path; null: none
    int nnumber;
    const OmEngineNumber* number;  // (nnumber)
} OmEngineInput;"""
    file: bytes | None
    nnumber: int
    number: Any


class OmTissueEngine(Struct):
    """typedef struct OmTissueEngine {
    int version;          // OM_ENGINE_VERSION
    const char* name;     // in scenes and messages
    const char* summary;  // for reports: "finite elements"; null: the name
    // Names of the scene numbers that have an effect ("young", "poisson", "rayleigh_stiffness", "cluster_spacing"),
    // ended by null; null: density alone. A law has an effect if has_law.
    const char* const* number;
    bool has_law;     // uses the law of OmTissueDef.material
    bool has_forces;  // `step` writes forces in newtons (om_engine_tool_force)
    // attachments may be springs (om_engine_find_spring); false: they are refused
    bool has_springs;
    bool can_average;  // supports OmTissueDef.is_averaged
    bool needs_file;   // `load` needs a file

    /// Make the engine's options from a file and numbers. The model owns them until it is destroyed. Null: the engine
    /// has no options.
    OmStatus (*load)(const OmEngineInput* input, void** options);
    void (*unload)(void* options);
    /// Make the engine's data of a model (om_engine_set_data), from the checked mesh, definition and options.
    /// `destroy` is called also after a create that failed, and where the model failed before `create`: data is then
    /// null.
    OmStatus (*create)(OmTissueModel* model);
    void (*destroy)(OmTissueModel* model);
    /// Make the engine's data of a work (om_engine_set_work_data); both may be null.
    OmStatus (*create_work)(const OmTissueModel* model, OmTissueWork* work);
    void (*destroy_work)(OmTissueWork* work);
    /// Write A (om_engine_matrix) and b (om_engine_rhs). Null for engines with `step`.
    OmStatus (*assemble)(const OmTissueModel* model, const OmTissueState* state, OmTissueWork* work,
                         const OmAssembly* at);
    /// Compute a whole step with tools and obstacles; report->substeps is set, and each obstacle's force,
    /// torque, ncontact and penetration. With has_forces it writes om_engine_tool_force, the force of the tool
    /// or attachment on each prescribed vertex, and om_tissue_contact_force, the force of obstacles.
    /// The last call is om_engine_end_step. A step that fails leaves the state unchanged.
    OmStatus (*step)(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work, double h,
                     int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report);
    /// Masses of the vertices, kg (nvert), of a mesh without elements. Null: the engine needs elements.
    OmStatus (*lump_mass)(const OmTissueModel* model, double* mass);
    /// Size of the engine's bytes in a state (om_engine_state_data), and their update after a caller has set positions.
    /// Both may be null.
    size_t (*get_state_size)(const OmTissueModel* model);
    void (*sync_state)(const OmTissueModel* model, OmTissueState* state);

    // Engines with `assemble` need the next function; the others may be null.
    /// Elastic forces at x in double. With a mask only forces on its vertices are computed. They are added
    /// to *sum, and to force (nvert x 3) unless it is null.
    OmStatus (*add_internal_force)(const OmTissueModel* model, const double* x,
                                   const unsigned char* mask, double* force, OmVec3* sum);
    /// A measure of every element (ntet).
    OmStatus (*get_measure)(const OmTissueModel* model, const double* x, OmTissueMeasure measure,
                            double* value);
    OmStatus (*get_energy)(const OmTissueModel* model, const double* x, double* energy);  // J
    /// Forces and energy for Newton's method, computed by all workers: force (nvert x 3) is overwritten.
    OmStatus (*eval_balance)(const OmTissueModel* model, OmTissueWork* work, const double* x,
                             double* force, double* energy);
    /// What a step from x_begin to x_end does to the elements. Null: no step is refused.
    void (*check)(const OmTissueModel* model, const OmTissueWork* work, const double* x_begin,
                  const double* x_end, bool is_solved, OmTissueCheck* check);
    /// Bytes of the engine's data of a model and a work.
    size_t (*get_memory)(const OmTissueModel* model, const OmTissueWork* work);
} OmTissueEngine;"""
    version: int
    name: bytes | None
    summary: bytes | None
    number: Any
    has_law: bool
    has_forces: bool
    has_springs: bool
    can_average: bool
    needs_file: bool
    load: Any
    unload: Any
    create: Any
    destroy: Any
    create_work: Any
    destroy_work: Any
    assemble: Any
    step: Any
    lump_mass: Any
    get_state_size: Any
    sync_state: Any
    add_internal_force: Any
    get_measure: Any
    get_energy: Any
    eval_balance: Any
    check: Any
    get_memory: Any


class OmEngineSet(Struct):
    """typedef struct OmEngineSet {  // engines to choose from by name; {0} is empty
    int nengine;
    const OmTissueEngine* engine[OM_MAX_ENGINE];  // borrowed, constant tables
} OmEngineSet;"""
    nengine: int
    engine: Any


class OmBodyForces(Struct):
    """typedef struct OmBodyForces {  // N; world frame
    OmVec3 grasp[OM_MAX_ARM];  // force of the tool on the grasped patch
    OmVec3 pull[OM_MAX_ARM];   // grasp minus the weight that the ground no longer carries
    OmVec3 attachment;         // by attachments, on the tissue
    OmVec3 contact;            // by ground and organ, on the tissue
    OmVec3 weight;             // of the tissue
} OmBodyForces;"""
    grasp: Any
    pull: Any
    attachment: Numbers
    contact: Numbers
    weight: Numbers


class OmBodyReport(Struct):
    """typedef struct OmBodyReport {  // of the last step
    int iterations;            // of the linear solver, all substeps
    double residual;           // |b - A x| / |b|, the worst
    int substeps;              // 1 unless the step had to be cut
    int ncontact;              // vertices in contact
    double penetration;        // m, largest
    int ninverted;             // elements that are inverted at its end
    double energy_gain;        // J, rise of energy beyond the work done; 0: none
} OmBodyReport;"""
    iterations: int
    residual: float
    substeps: int
    ncontact: int
    penetration: float
    ninverted: int
    energy_gain: float


class OmBodyParts(Struct):
    """typedef struct OmBodyParts {  // data that a definition of tissue borrows
    OmEngineInput input;
    OmEngineNumber number[OM_BODY_NUMBERS];
    char file[2 * OM_SCENE_PATH];
    OmMaterial material[OM_SITE_MATERIALS];
    double density[OM_SITE_MATERIALS];
} OmBodyParts;"""
    input: OmEngineInput
    number: Any
    file: str
    material: Any
    density: Numbers


class OmCalibrationParam(Struct):
    """typedef struct OmCalibrationParam {
    char name[OM_CALIBRATION_NAME];  // the key in a scene: "tissue.young", "pbd.radius_mm"
    double lo, hi;                   // bounds, SI, lo < hi
    double start;                    // first guess, between lo and hi
    bool is_log;                     // search on a logarithmic scale; lo > 0
    double unit;                     // the unit of the name in SI: 1e-3 for "_mm"; default 1
} OmCalibrationParam;"""
    name: str
    lo: float
    hi: float
    start: float
    is_log: bool
    unit: float


class OmCalibrationLabel(Struct):
    """typedef struct OmCalibrationLabel {  // meaning of one error, for the report
    int experiment;                  // index into def.experiment
    int landmark;                    // index into def.landmark
    double level;                    // deformation there, m
} OmCalibrationLabel;"""
    experiment: int
    landmark: int
    level: float


class OmCalibrationDef(Struct):
    """typedef struct OmCalibrationDef {     // made by om_calibration_default_def
    const char* title;                // of the report; default "Calibration"
    OmCalibrationFn eval;             //
    void* ctx;                        // borrowed
    OmCalibrationFinerFn eval_finer;  // with the same ctx, after each local stage; default null
    // Hash of everything that eval depends on besides the parameters; a journal of another hash is
    // refused. Default 0.
    uint64_t problem;
    int nparam;  // 1 to OM_CALIBRATION_MAX_PARAM
    OmCalibrationParam param[OM_CALIBRATION_MAX_PARAM];
    int nerror;                       // >= 1
    const OmCalibrationLabel* label;  // borrowed; default null: no table of errors   (nerror)
    int nexperiment, nlandmark;
    const char* const* experiment;  // names, borrowed                               (nexperiment)
    const char* const* landmark;    // names, borrowed                                 (nlandmark)
    OmCalibrationNorm norm;         // default OM_NORM_MEAN
    double norm_size;  // Huber: m, default 0: twice the noise; trimmed: share, default 0: 0.2
    double noise;      // cost of a perfect model, m; default 0: not known
    OmCalibrationGlobal global;  // default OM_GLOBAL_EVOLUTION
    int population;              // default 0: 8 for each parameter, at least 12
    int max_generations;         // default 40
    OmCalibrationLocal local;    // default OM_LOCAL_SUBPLEX
    int max_local;               // evaluations; default 0: 60 for each parameter
    double local_range;  // fraction of the range around the start, (0, 1]; default 0.4 (3.5.1)
    double tolerance;    // of a parameter relative to its range, ends the local stage; default 1e-3
    int patience;        // generations without 1 % of progress that end the global stage; default 8
    double unfit;        // stagnation above unfit * noise means: the model cannot fit; default 4
    // Sensitivity: the relative rise of the cost that bounds an interval. Where the cost is below
    // the noise, the rise is relative to the noise instead. Default 0.1; 0: no sensitivity.
    double rise;
    uint64_t seed;        // default 1
    int nworker;          // default 0: one for each processor
    const char* out_dir;  // for journal and report; default null: no files, no resuming
    OmCookie cookie;
} OmCalibrationDef;"""
    title: bytes | None
    eval: Any
    ctx: Any
    eval_finer: Any
    problem: int
    nparam: int
    param: Any
    nerror: int
    label: Any
    nexperiment: int
    nlandmark: int
    experiment: Any
    landmark: Any
    norm: Choice[OmCalibrationNorm]
    norm_size: float
    noise: float
    global_: Choice[OmCalibrationGlobal]
    population: int
    max_generations: int
    local: Choice[OmCalibrationLocal]
    max_local: int
    local_range: float
    tolerance: float
    patience: int
    unfit: float
    rise: float
    seed: int
    nworker: int
    out_dir: bytes | None
    cookie: int


class OmCalibrationProfile(Struct):
    """typedef struct OmCalibrationProfile {   // the cost along one parameter, the others at the optimum
    double x[OM_CALIBRATION_NPROFILE];  // ascending, SI
    double cost[OM_CALIBRATION_NPROFILE];
    double lo, hi;  // interval in which the cost rises by less than def.rise
    // The same with the error of the mesh, result.mesh_cost, added as squares to what bounds lo and hi. Equal to them
    // where the mesh hardly matters.
    double mesh_lo, mesh_hi;
    bool is_open_lo, is_open_hi;  // the interval ends at the bound of the parameter
    // Another parameter that compensates a change of this one, or -1: the cost hardly rises along the valley of both,
    // their correlation partner_rho exceeds 0.95. partner_rho is 0 without partner.
    double partner_rho;
    int partner;
    bool is_determined;  // the interval is closed on both sides, and there is no partner
} OmCalibrationProfile;"""
    x: Numbers
    cost: Numbers
    lo: float
    hi: float
    mesh_lo: float
    mesh_hi: float
    is_open_lo: bool
    is_open_hi: bool
    partner_rho: float
    partner: int
    is_determined: bool


class OmCalibrationResult(Struct):
    """typedef struct OmCalibrationResult {  // om_calibration_result_done frees
    OmCalibrationOutcome outcome;
    int nparam, nerror;
    int neval, nnew;  // all evaluations; those made by this call
    int nglobal, nlocal,
        nprofile;  // evaluations by stage, besides one at the start and one at the end
    int ngeneration;
    double best[OM_CALIBRATION_MAX_PARAM];  // SI
    double cost_start, cost_global, cost;   // m
    double *error_start, *error;            // at start and best, m                 (nerror)
    double* trace;                          // cost of every evaluation in order    (neval)
    bool has_profile;
    // What the best parameters owe to the mesh: with them a finer one shows something else, by mesh_difference; all of
    // the mesh's error is mesh_cost, extrapolated for elements of second order.
    bool has_mesh;
    double mesh_ratio, mesh_difference, mesh_cost;  // edges over the finer ones; m
    bool is_of_mesh;  // mesh_cost exceeds the noise, or the cost where that is not known
    OmCalibrationProfile profile[OM_CALIBRATION_MAX_PARAM];
} OmCalibrationResult;"""
    outcome: Choice[OmCalibrationOutcome]
    nparam: int
    nerror: int
    neval: int
    nnew: int
    nglobal: int
    nlocal: int
    nprofile: int
    ngeneration: int
    best: Numbers
    cost_start: float
    cost_global: float
    cost: float
    error_start: Any
    error: Any
    trace: Any
    has_profile: bool
    has_mesh: bool
    mesh_ratio: float
    mesh_difference: float
    mesh_cost: float
    is_of_mesh: bool
    profile: Any


class OmContactPlane(Struct):
    """typedef struct OmContactPlane {
    OmVec3 point;   // on the plane, m
    OmVec3 normal;  // towards the free side; any length but zero
} OmContactPlane;"""
    point: Numbers
    normal: Numbers


class OmContactDef(Struct):
    """typedef struct OmContactDef {  // made by om_contact_default_def
    int nobstacle;
    // copied; distance fields, functions and probes stay borrowed   (nobstacle)
    const OmTissueObstacle* obstacle;
    double offset;         // m, distance kept from every obstacle besides its own, >= 0; default 0
    double stiffness;      // penalty over the vertex's own stiffness, 1 to 1e6; default 1000
    double recover_speed;  // m/s, at which tissue that starts inside is pushed out; default 0.1
    // Coulomb's coefficient of obstacles whose own is negative, at most 10, regularised below 1 mm/s. Negative
    // (default): OmPbdDef.friction for engine "pbd", no friction for the other engines.
    double friction;
    int max_iterations;  // largest number of solves in a step, >= 1; default 12
    OmCookie cookie;     // set by om_contact_default_def
} OmContactDef;"""
    nobstacle: int
    obstacle: Any
    offset: float
    stiffness: float
    recover_speed: float
    friction: float
    max_iterations: int
    cookie: int


class OmContactReport(Struct):
    """typedef struct OmContactReport {
    OmTissueReport tissue;  // of the linear solver, all solves
    int nsolve;             // solves, all substeps
    int ncontact;           // vertices that are pushed
    double penetration;     // m, the deepest after the step
    OmVec3 force;           // N, resultant on the tissue, presses included
    // The obstacles with their force, torque, ncontact and penetration, of the last substep; a view, valid until the
    // next step. Presses have reports of their own (om_press_report).
    int nobstacle;
    const OmTissueObstacle* obstacle;
    bool is_settled;  // in all substeps: contact vertices, planes of curved obstacles and friction
                      // stopped changing; false only with OM_NOT_CONVERGED
} OmContactReport;"""
    tissue: OmTissueReport
    nsolve: int
    ncontact: int
    penetration: float
    force: Numbers
    nobstacle: int
    obstacle: Any
    is_settled: bool


class OmProbeDef(Struct):
    """typedef struct OmProbeDef {  // made by om_probe_default_def; lengths in m
    OmProbeShape shape;      //
    OmVec3 size;             // box: its sides; default 50 x 10 x 60 mm
    double rounding;         // box: radius of its edges, >= 0, at most half its sides; default 1 mm
    double radius;           // sphere and capsule; default 25 mm and 5 mm
    double length;           // capsule, >= 0; default 50 mm
    const OmSurface* surface;  // mesh: closed, outward; copied by create
    OmCookie cookie;           // set by om_probe_default_def
} OmProbeDef;"""
    shape: Choice[OmProbeShape]
    size: Numbers
    rounding: float
    radius: float
    length: float
    surface: Any
    cookie: int


class OmPressDef(Struct):
    """typedef struct OmPressDef {  // made by om_press_default_def
    // The probe; any other obstacle serves, too. Copied, its ctx is borrowed until destroy. Poses and friction in it
    // are not used.
    OmTissueObstacle obstacle;
    OmPressMethod method;  // default OM_PRESS_PENALTY
    // The contact surface in the rest shape, copied; null: made from the boundary of the mesh.
    const OmSurface* surface;
    int ntri;  // triangles of one that is made; default 1004; 0: the unchanged boundary
    // Penalty and prescribed: N/m for each contact point. 0 (default): 100 times the stiffness against moving the
    // point alone, which lets the tissue penetrate by some hundredths of a millimetre.
    double stiffness;
    double friction;  // Coulomb's coefficient, 0 to 10, not for prescribed; default 0
    // Multipliers: largest |min(lambda / lambda_max, gap / edge)|; default 1e-4. 1e-8 is for tests, and needs a linear
    // solver of tolerance 1e-10.
    double tolerance;
    int max_iterations;  // largest number of solves in a substep, >= 1; default 40
    // Multipliers. 0 (default): an augmented Lagrangian; with friction the same as 1. 1: a Delassus matrix in each
    // step. n > 1: n steps share one matrix (thesis: 5); then a step depends on the steps before it.
    int reuse;
    OmVec3 direction;  // prescribed: direction of pressing in the probe's frame; default (0, 0, -1)
    double reach;      // prescribed: depth of the area before the probe, m; default 0.01
    OmCookie cookie;   // set by om_press_default_def
} OmPressDef;"""
    obstacle: OmTissueObstacle
    method: Choice[OmPressMethod]
    surface: Any
    ntri: int
    stiffness: float
    friction: float
    tolerance: float
    max_iterations: int
    reuse: int
    direction: Numbers
    reach: float
    cookie: int


class OmPressReport(Struct):
    """typedef struct OmPressReport {
    OmTissueReport tissue;  // of the linear solver, all solves; substeps
    int nsolve;             // solves with the system matrix, columns of W not counted
    int ncolumn;            // multipliers: columns of W solved for
    int ncontact;           // points that are pushed
    // In all substeps the contact points, the planes that stand for the probe, and friction stopped
    // changing, and the tolerance was met. False only with OM_NOT_CONVERGED.
    bool is_settled;
    OmVec3 force;            // N, by the tissue on the probe, world axes
    OmVec3 torque;           // N m, about the probe's origin, world axes
    double area;             // m^2, of the contact surface at those points
    double penetration;      // m, of the deepest point of the contact surface after the step
    double complementarity;  // multipliers: max |min(lambda / lambda_max, gap / edge)|
    // views (ncontact), valid until the next step
    const int* vert;       // contact surface vertex
    const double* point;   // m, world                                    (ncontact x 3)
    const double* normal;  // from the probe to the tissue, world          (ncontact x 3)
    const double* push;    // N, on the tissue                            (ncontact x 3)
    const double* gap;     // m, negative inside                          (ncontact)
} OmPressReport;"""
    tissue: OmTissueReport
    nsolve: int
    ncolumn: int
    ncontact: int
    is_settled: bool
    force: Numbers
    torque: Numbers
    area: float
    penetration: float
    complementarity: float
    vert: Any
    point: Any
    normal: Any
    push: Any
    gap: Any


class OmCalibrationPath(Struct):
    """typedef struct OmCalibrationPath {
    const char* name;
    OmCalibrationPathKind kind;
    OmVec3 point;          // press: origin of the probe at first touch; lift: the pinch point; m
    OmVec3 direction;      // of travel, any length but zero
    OmVec3 along;          // press: the probe's x axis, any length; zero: any normal to `direction`
    double radius;         // lift: of the grasp, m; 0: 5 mm
    const OmProbe* probe;  // press: its z axis is -direction; borrowed
    OmPressMethod method;  // press
    int contact_ntri;      // press: triangles of the contact surface; 0: the unchanged boundary
    double friction;       // press
    double speed;          // m/s, > 0
    double time_step;      // s, > 0
    double settle;         // s, steps without travel before the path and at each level
    int nlevel;
    const double* level;  // travel, m, ascending, from 0                                  (nlevel)
} OmCalibrationPath;"""
    name: bytes | None
    kind: Choice[OmCalibrationPathKind]
    point: Numbers
    direction: Numbers
    along: Numbers
    radius: float
    probe: Any
    method: Choice[OmPressMethod]
    contact_ntri: int
    friction: float
    speed: float
    time_step: float
    settle: float
    nlevel: int
    level: Any


class OmCalibrationSeen(Struct):
    """typedef struct OmCalibrationSeen {
    int path, level;  // indices
    int landmark;     // index, or one of the constants above
    OmVec3 x;         // position, m; or the force, N
} OmCalibrationSeen;"""
    path: int
    level: int
    landmark: int
    x: Numbers


class OmCalibrationTissueDef(Struct):
    """typedef struct
    OmCalibrationTissueDef {  // made by om_calibration_tissue_default_def; arrays are copied
    OmCalibrationBuildFn build;
    void* ctx;  // borrowed
    // Obstacles below the tissue; null: none. Borrowed, with everything it points to.
    const OmContactDef* contact;
    int npath;
    const OmCalibrationPath* path;  // names and probes are borrowed                   (npath)
    int nlandmark;
    const char* const* landmark;  // names, borrowed; may be null                  (nlandmark)
    const double* rest;           // in the rest shape, m                      (nlandmark x 3)
    int nobservation;
    const OmCalibrationSeen* observation;  // in any order                      (nobservation)
    double force_scale;                    // m of error for each newton of difference; default 0.01
    int ncloud_point;  // points of the model compared with clouds; default 0: its surface vertices
    const double* cloud_point;  // in the rest shape, m                     (ncloud_point x 3)
    OmCookie cookie;
} OmCalibrationTissueDef;"""
    build: Any
    ctx: Any
    contact: Any
    npath: int
    path: Any
    nlandmark: int
    landmark: Any
    rest: Any
    nobservation: int
    observation: Any
    force_scale: float
    ncloud_point: int
    cloud_point: Any
    cookie: int


class OmAheadDef(Struct):
    """typedef struct OmAheadDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed until destroy: task and endoscope
    const OmSite* site;    // of the twin; borrowed until destroy
    int npoint;  // points tried for one plan, at most; default: the task's `ahead`, or 3 where this is 0
    int max_step;  // steps of the twin for one plan; default 5000
    // A point that exposes the ROI is repeated in a twin of half the modulus. If the ROI stays hidden there, the point
    // counts only if no other point is confirmed. Default true.
    bool is_repeated;
} OmAheadDef;"""
    cookie: int
    scene: Any
    site: Any
    npoint: int
    max_step: int
    is_repeated: bool


class OmModulusDef(Struct):
    """typedef struct OmModulusDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed until destroy
    const OmSite* site;    // of the twin; borrowed until destroy
    // Computes the loop's estimates of attachments; it is given the learnt modulus before each. Borrowed; null: none.
    OmMatch* match;
    // From measured pulls; by default where OmSceneUpdate.learns_modulus is set, or by_shape is not.
    bool by_force;
    // From what the monitor's camera sees; default OmSceneUpdate.learns_modulus_by_shape.
    bool by_shape;
} OmModulusDef;"""
    cookie: int
    scene: Any
    site: Any
    match: Any
    by_force: bool
    by_shape: bool


class OmPsm(Struct):
    """typedef struct OmPsm {
    OmPose pose_world_rcm;        // base frame at the remote centre of motion
    double wrist;                 // m, wrist pitch axis to wrist yaw axis
    double q_min[OM_PSM_NJOINT];  // rad; m for the insertion
    double q_max[OM_PSM_NJOINT];
    double jaw_min, jaw_max;  // rad
} OmPsm;"""
    pose_world_rcm: OmPose
    wrist: float
    q_min: Numbers
    q_max: Numbers
    jaw_min: float
    jaw_max: float


class OmPsmCapsule(Struct):
    """typedef struct OmPsmCapsule {  // points within `radius` of the segment from a to b; world frame, m
    OmVec3 a, b;
    double radius;
} OmPsmCapsule;"""
    a: Numbers
    b: Numbers
    radius: float


class OmArmObservation(Struct):
    """typedef struct OmArmObservation {
    double time;              // s, of the measurement
    OmPose tip;               // measured pose_world_tip
    double q[OM_PSM_NJOINT];  // measured joints: yaw, pitch, insertion (m), roll, wrist; rad
    double jaw;               // measured opening, rad
    double jaw_speed;         // measured, rad/s; below 0: the jaw closes
    double jaw_goal;          // commanded opening, rad
    bool is_moving;           // a commanded motion of the tip is under way
    // Estimate of the load on the tip, world frame, N and N m; without an estimate has_wrench is false and both are 0.
    // A simulated arm has one if the scene sets `world: force_noise`; its torque is 0.
    bool has_wrench;
    OmVec3 force, torque;
} OmArmObservation;"""
    time: float
    tip: OmPose
    q: Numbers
    jaw: float
    jaw_speed: float
    jaw_goal: float
    is_moving: bool
    has_wrench: bool
    force: Numbers
    torque: Numbers


class OmWorldPicture(Struct):
    """typedef struct OmWorldPicture {  // of the endoscope
    double time;                 // s, of the exposure; also of `visibility`
    OmCamera camera;             // intrinsics and pose, of the whole picture
    OmWindow window;             // the part of it that `color` shows; width 0: all of it
    OmPicture color;             // RGB; empty: not observed
} OmWorldPicture;"""
    time: float
    camera: OmCamera
    window: OmWindow
    color: OmPicture


class OmDepthPicture(Struct):
    """typedef struct OmDepthPicture {  // of the depth camera
    double time;                 // s, of the exposure
    OmCamera camera;             // intrinsics and pose
    // m along the camera's z; 0, NaN or infinite: no return  (height x width); null: not observed
    float* depth;
    OmPicture color;  // RGB of the same pixels; empty: not observed
} OmDepthPicture;"""
    time: float
    camera: OmCamera
    depth: Any
    color: OmPicture


class OmObservation(Struct):
    """typedef struct OmObservation {         // om_observation_done frees; zero-initialise
    double time;                       // s, of the world's clock
    int narm;                          //
    OmArmObservation arm[OM_MAX_ARM];  // (narm)
    // Visible fraction of the ROI, 0 to 1, at endoscope.time. A simulated world computes it exactly, by rays against
    // its true geometry: this is the judge's. A controller measures its own in the endoscope's picture, see OmRoiMeter
    // (world_cloud.h).
    double visibility;
    OmWorldPicture endoscope;
    OmDepthPicture rgbd;
} OmObservation;"""
    time: float
    narm: int
    arm: Any
    visibility: float
    endoscope: OmWorldPicture
    rgbd: OmDepthPicture


class OmWorldOps(Struct):
    """typedef struct OmWorldOps {
    void (*destroy)(OmWorld* world);
    OmStatus (*move)(OmWorld* world, int arm, OmPose goal, double speed);
    OmStatus (*set_jaw)(OmWorld* world, int arm, double angle);
    void (*stop)(OmWorld* world, int arm);
    OmStatus (*advance)(OmWorld* world, double dt);
    OmStatus (*observe)(OmWorld* world, unsigned what, OmObservation* observation);
    OmStatus (*reset)(OmWorld* world);                    // optional
    size_t (*state_size)(const OmWorld* world);           // optional, with save and restore
    void (*save)(const OmWorld* world, void* block);      //
    void (*restore)(OmWorld* world, const void* block);   //
    void (*set_window)(OmWorld* world, OmWindow window);  // optional; needed by OM_OBSERVE_WINDOW
} OmWorldOps;"""
    destroy: Any
    move: Any
    set_jaw: Any
    stop: Any
    advance: Any
    observe: Any
    reset: Any
    state_size: Any
    save: Any
    restore: Any
    set_window: Any


class OmWorld(Struct):
    ops: Any
    narm: int
    sources: int
    psm: Any


class OmCloudDef(Struct):
    """typedef struct OmCloudDef {
    OmCookie cookie;               // set by om_cloud_default_def
    const OmSite* site;            // board, organ and task frame as known before the operation
    const OmPsm* psm[OM_MAX_ARM];  // kinematics of the arms; null: the arm's tool is not left out
    // Points nearer to board or organ are left out, m; default 2 mm, six standard deviations of the noise at 0.3 m.
    double clearance;
    double tool_margin;  // points nearer to a tool are left out, m; default 2 mm
    // Largest expected displacement of tissue from rest, along each axis of the task, m; default 60 mm.
    double reach;
} OmCloudDef;"""
    cookie: int
    site: Any
    psm: Any
    clearance: float
    tool_margin: float
    reach: float


class OmCloudField(Struct):
    """typedef struct OmCloudField {  // tools and limits at the time of an observation
    OmCloudDef def;
    OmPose pose_task_world;
    OmVec3 lo, hi;  // reach of the tissue, task frame, m
    int ncapsule;
    OmPsmCapsule capsule[OM_MAX_ARM * OM_PSM_NCAPSULE];  // tools at their measured tips
} OmCloudField;"""
    def_: OmCloudDef
    pose_task_world: OmPose
    lo: Numbers
    hi: Numbers
    ncapsule: int
    capsule: Any


class OmCloud(Struct):
    """typedef struct OmCloud {
    double time;  // s, of the depth picture
    int n;        //
    double* x;    // world frame, m                              (n x 3)
    int* pixel;   // column + width * row of the depth picture   (n)
} OmCloud;"""
    time: float
    n: int
    x: Any
    pixel: Any


class OmMonitorDef(Struct):
    """typedef struct OmMonitorDef {
    OmCookie cookie;          // set by om_monitor_default_def
    OmSceneMonitor settings;  // limits, hysteresis, rate, number of points
    // Tools, fixed anatomy and reach. Where a picture has colour, `clearance` is not used.
    OmCloudDef space;     // its arms are copied, its site is borrowed
    bool use_color;       // default true; a picture without colour is segmented by space alone
    OmSenseRange tissue;  // colours of the tissue; default om_sense_range(OM_PART_TISSUE)
    int nray;             // of the simulated camera, 256 to 2^20; default 4096
    double max_age;       // s, above 0: an older picture is stale; default 0.2
} OmMonitorDef;"""
    cookie: int
    settings: OmSceneMonitor
    space: OmCloudDef
    use_color: bool
    tissue: OmSenseRange
    nray: int
    max_age: float


class OmMonitorFrame(Struct):
    """typedef struct OmMonitorFrame {
    double time;      // s, of the observation
    double age;       // s, from the exposure of the depth picture to the observation
    double distance;  // m, median of the closest distances, or another quantile of the settings
    double rest;  // m, mean distance of the frames before the first grasp; 0 without such frames
    double mu;    // m, distance less rest
    // m, exceeded by a part of the tissue, part_share of the points: the lift of the twin where the picture shows
    // tissue that lies still since before the grasp, or the distance of moved tissue from a twin that lies still
    double part;
    // m, mean closest distance over all points, less its mean over the frames before the first grasp
    double mean;
    int npoint;  // measured points on the tissue
    int nmoved;  // points that moved, of region OM_MONITOR_MOVED; fewer than 30: mu is 0
    int nrest;   // frames in `rest`
    int state;   // warning state, 0 to 3; 0 before the first grasp
    // The picture was older than max_age. As in a blind frame, rest and state are unchanged, and the distance is that
    // of the last good frame (0: there was none).
    bool is_stale;
    // Fewer than OM_MONITOR_MIN_POINT points, the twin is out of sight, or a tool's pose is not a number.
    bool is_blind;
    int nstale, nblind;  // frames so far since the last reset
    double unseen;       // s since the last frame that was neither, or since the first one
} OmMonitorFrame;"""
    time: float
    age: float
    distance: float
    rest: float
    mu: float
    part: float
    mean: float
    npoint: int
    nmoved: int
    nrest: int
    state: int
    is_stale: bool
    is_blind: bool
    nstale: int
    nblind: int
    unseen: float


class OmExposure(Struct):
    """typedef struct OmExposure {
    bool is_known;    // default false; the other fields then have no meaning
    bool exposes;     // the ROI was exposed, and it stayed exposed
    int npull;        // pulls made before the fold, or until the ROI was exposed; 1 or more
    OmPlanVerb fold;  // OM_PLAN_MOVE_ROI, OM_PLAN_MOVE_AWAY; OM_PLAN_PULL: pulls alone
} OmExposure;"""
    is_known: bool
    exposes: bool
    npull: int
    fold: Choice[OmPlanVerb]


class OmArmSituation(Struct):
    """typedef struct OmArmSituation {  // one arm, as sensed
    int at;                      // block below the tool, -1 none: fluent at
    int in_hand;                 // block held, -1 none: fluent in_hand; then the gripper is closed
    bool is_closed;              // gripper below 20 degrees: fluent closed_gripper
    bool is_max_height;          // tool at the height limit: fluent max_height
    bool is_max_force;           // force above the threshold: fluent max_force
    int nlift;                   // pulls of 10 mm already made with the tissue held, 0 or more
} OmArmSituation;"""
    at: int
    in_hand: int
    is_closed: bool
    is_max_height: bool
    is_max_force: bool
    nlift: int


class OmSituation(Struct):
    """typedef struct OmSituation {
    int n;                                   // blocks along a side, 1 to OM_PLAN_MAX_GRID
    bool is_fixed[OM_PLAN_MAX_BLOCK];        // the block is above attachment points
    bool is_above_roi[OM_PLAN_MAX_BLOCK];    // the block is above the ROI; at least one is
    bool is_forbidden[OM_PLAN_MAX_BLOCK];    // a person forbade to grasp the block
    uint8_t reachable[OM_PLAN_MAX_BLOCK];    // bit a: arm a reaches the block
    uint8_t tried[OM_PLAN_MAX_BLOCK];        // bits OmTried
    OmArmSituation arm[OM_MAX_ARM];          // psm1, psm2
    OmExposure exposure[OM_PLAN_MAX_BLOCK];  // what trying each block in the simulation showed
    bool is_visible;                         // the ROI is seen: the plan is empty
    double spacing;                          // between centres of neighbouring blocks, m, > 0
    const double* center;  // of each block (n*n x 3), m, borrowed; null: a flat grid
} OmSituation;"""
    n: int
    is_fixed: Numbers
    is_above_roi: Numbers
    is_forbidden: Numbers
    reachable: Numbers
    tried: Numbers
    arm: Any
    exposure: Any
    is_visible: bool
    spacing: float
    center: Any


class OmPlanAction(Struct):
    """typedef struct OmPlanAction {
    OmPlanVerb verb;
    int arm;    // 0: psm1, 1: psm2
    int block;  // -1 for release
    int time;   // step of the plan, from 0
} OmPlanAction;"""
    verb: Choice[OmPlanVerb]
    arm: int
    block: int
    time: int


class OmPlan(Struct):
    """typedef struct OmPlan {
    OmStatus outcome;  // OM_OK, OM_UNSAT or OM_TIMEOUT, as om_planner_solve returned
    int n;             // grid of the situation it was made for
    int naction;       // 0 when the ROI is already visible, and when there is no plan
    OmPlanAction action[OM_PLAN_MAX_HORIZON];  // in order of time
    int grasp_block;  // block that is newly grasped; -1 if the plan continues with a held block
    int grasp_arm;    // the arm that grasps it, -1
    // By priority: new grasps; new grasps of blocks known not to expose the ROI; distance of the grasp from the ROI in
    // 0.1 mm; minus its distance from the attachments in 0.1 mm; number of actions; order of preference between equal
    // plans. All 0 for a user's program with another number of levels.
    int64_t cost[OM_PLAN_NCOST];
    bool is_optimal;     // no better plan exists within the horizon
    bool is_reground;    // the program was grounded for this plan, not only solved again
    double ground_time;  // s, to adapt the ground program to the situation
    double solve_time;   // s
} OmPlan;"""
    outcome: Choice[OmStatus]
    n: int
    naction: int
    action: Any
    grasp_block: int
    grasp_arm: int
    cost: Numbers
    is_optimal: bool
    is_reground: bool
    ground_time: float
    solve_time: float


class OmPlannerDef(Struct):
    """typedef struct OmPlannerDef {
    OmCookie cookie;
    int horizon;          // time steps a plan may take; default 12, range 1 to OM_PLAN_MAX_HORIZON
    int max_lift;         // pulls of 10 mm from the tissue to the height limit; default 5 (50 mm)
    const char* program;  // a file in place of the built-in asp/tissue_retraction.lp; null
    uint32_t seed;  // of clasp; default 1. The optimum is unique, so plans do not depend on it
    // For a user's program: also add facts metric(B1,B2,X) for all pairs of blocks, and set the external atoms
    // distance(B1,B2,X,0) if the program declares them. Default false: only distances to the ROI and to attachments.
    bool has_all_distances;
    // An arm may keep its tissue up while the other one grasps and pulls; default false: it lets go first.
    bool has_both_arms;
    // Conflicts of the search that a solve may take, 0: no limit; default 100000. The same situations give the same
    // plans on a machine of any speed.
    int conflict_limit;
    // s that a solve may take as well; default 0: no limit. With it plans depend on the speed of the machine. Grounding
    // has no limit: a program of one's own that describes too many atoms, or infinitely many, does not return.
    // `omentum plan` grounds in a child process for that.
    double time_limit;
} OmPlannerDef;"""
    cookie: int
    horizon: int
    max_lift: int
    program: bytes | None
    seed: int
    has_all_distances: bool
    has_both_arms: bool
    conflict_limit: int
    time_limit: float


class OmPreplanPoint(Struct):
    """typedef struct OmPreplanPoint {  // a grasping point and the best that it reached
    int block, arm;              // arm -1: none
    OmPreplanVerdict verdict;
    bool is_tried;      // false: the fields below are 0
    bool exposes;       // the task's visibility was reached, and it stayed
    int npull;          // pulls before the fold, or until the ROI was exposed
    OmPlanVerb fold;    // OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI; OM_PLAN_PULL: none
    double visibility;  // at its end, 0 to 1
    double force;       // N, largest pull; -1: the twin's engine has no forces
    int naction;        // as the loop counts: reach, grasp, each pull, each fold
    int nstep;          // of the twin, of all sequences tried
    int ntwin;  // changed twins in which the sequence was repeated; 0: the fields below are 0
    int ntwin_exposed;  // of these, in which the ROI was exposed at the end, the distance below that of state 3
    int ntwin_alike;  // of these, without more motion than in the believed twin
    // m: largest distance, median of the surface, from the believed twin at the same step
    double spread;
    int warning;        // state of Alg. 5 that this distance would raise, 0 to 3
    double force_most;  // N, largest pull in the changed twins
} OmPreplanPoint;"""
    block: int
    arm: int
    verdict: Choice[OmPreplanVerdict]
    is_tried: bool
    exposes: bool
    npull: int
    fold: Choice[OmPlanVerb]
    visibility: float
    force: float
    naction: int
    nstep: int
    ntwin: int
    ntwin_exposed: int
    ntwin_alike: int
    spread: float
    warning: int
    force_most: float


class OmPreplan(Struct):
    """typedef struct OmPreplan {
    char scene[OM_SCENE_NAME];
    int seed;
    int n;                                    // blocks along a side; there are n x n points
    OmPreplanPoint point[OM_PLAN_MAX_BLOCK];  // of each block
    int chosen;                               // its block, -1: nothing can be grasped
    bool is_exposing;                         // the chosen point reaches `visibility`
    double visibility;                        // that counts as exposed
    double force_limit;                       // N, at which pulls stopped; -1: none
    int ntried, nexposing;
    int64_t nstep;     // of the twin, all points
    char reason[256];  // one sentence: why this point, or the warning
} OmPreplan;"""
    scene: str
    seed: int
    n: int
    point: Any
    chosen: int
    is_exposing: bool
    visibility: float
    force_limit: float
    ntried: int
    nexposing: int
    nstep: int
    reason: str


class OmPreplanDef(Struct):
    """typedef struct OmPreplanDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed; only the twin's side of it is used
    int nworker;  // points in parallel; default 0: one a processor. The result does not depend on it
    int nlowest;  // of the exposing points this many of lowest force compete; default 3
    int nagain;  // exposing points repeated in changed twins; default 6; 0: none, the thesis's choice
} OmPreplanDef;"""
    cookie: int
    scene: Any
    nworker: int
    nlowest: int
    nagain: int


class OmScanDef(Struct):
    """typedef struct OmScanDef {
    OmCookie cookie;  // set by om_scan_default_def
    // Tools, fixed anatomy and reach. With colour, `clearance` is not used and `tool_margin` only for grey pixels:
    // a sheet lies on the board, and grasped tissue lies beside the jaws.
    OmCloudDef space;
    bool use_color;       // default true; a picture without colour is segmented by space alone
    OmSenseRange tissue;  // colours of the tissue; default om_sense_range(OM_PART_TISSUE)
    OmSenseRange tool;    // colours of tools and highlights; default om_sense_range(OM_PART_TOOL)
    // m, mean distance of neighbouring points, above 0; default the mean edge of the site's mesh
    double spacing;
    // m, above 0: neighbouring pixels whose depths differ by more are not connected; default 4 mm
    double max_jump;
    // Triangles with a smaller cosine between normal and ray are left out, 0 to 1; default 0.1.
    double min_cosine;
    // m^2, 0 or more: smaller pieces of tissue are left out; default 25 mm^2
    double min_area;
    int margin;  // pixels around a tool that are not tissue, 0 to 16; default 1
    // Noise of a depth, a + b z^2 for z in m: m and 1/m, 0 or more; default om_depth_noise_default. If neighbouring
    // pixels of the tissue show more noise, more is taken.
    double noise_a, noise_b;
} OmScanDef;"""
    cookie: int
    space: OmCloudDef
    use_color: bool
    tissue: OmSenseRange
    tool: OmSenseRange
    spacing: float
    max_jump: float
    min_cosine: float
    min_area: float
    margin: int
    noise_a: float
    noise_b: float


class OmScanRegion(Struct):
    """typedef struct OmScanRegion {  // pixels of a picture: a disc around a click, or a box
    bool is_box;
    double u, v, radius;             // of the disc: centre in pixel coordinates, pixels
    int column, row, width, height;  // of the box: its first pixel and its size
} OmScanRegion;"""
    is_box: bool
    u: float
    v: float
    radius: float
    column: int
    row: int
    width: int
    height: int


class OmUpdateDef(Struct):
    """typedef struct OmUpdateDef {
    OmCookie cookie;
    OmScanDef scan;          // how the tissue is found in pictures; its site is borrowed
    OmSceneUpdate settings;  // latency, number of acquisitions, smallest lift, rest
    // Default null: acquisitions are taken, for listeners, and nothing is estimated. The arms do not wait then, and the
    // newest picture is taken, which may be from before the end of the action.
    OmEstimateFn estimate;
    void* estimate_ctx;  // borrowed by the job
    // Default OM_UPDATE_AFTER_LATENCY in a world that has snapshots, otherwise OM_UPDATE_WHEN_READY.
    OmUpdateTiming timing;
    // OmRetractUpdate.end_tick of each estimate of the recorded run, below 0: never taken; copied  (nreplay)
    const int* replay_tick;
    int nreplay;
} OmUpdateDef;"""
    cookie: int
    scan: OmScanDef
    settings: OmSceneUpdate
    estimate: Any
    estimate_ctx: Any
    timing: Choice[OmUpdateTiming]
    replay_tick: Any
    nreplay: int


class OmUpdateEvent(Struct):
    """typedef struct OmUpdateEvent {  // for OmLoopListener.on_update; pointers are valid during the call
    OmUpdateStage stage;
    int index;  // of the acquisition if it was taken, otherwise of the estimate; both count from 0
    int tick;   // of the loop
    double time;                       // s of the operation
    const OmAcquisition* acquisition;  // taken; otherwise null
    int nacquisition;  // that the estimate is made from; 0 if an acquisition was taken
    // adopted, or refused or followed with a result; of doubt the number of vertices and `attached`; otherwise null
    const OmMatchEstimate* estimate;
    const char* reason;  // of a refusal, also before a following; what is doubted; otherwise ""
    // attachments of the twin before an adoption or a doubt; otherwise null  (nvert)
    const unsigned char* was_attached;
} OmUpdateEvent;"""
    stage: Choice[OmUpdateStage]
    index: int
    tick: int
    time: float
    acquisition: Any
    nacquisition: int
    estimate: Any
    reason: bytes | None
    was_attached: Any


class OmRetractSample(Struct):
    """typedef struct OmRetractSample {  // one instant
    double time;        // s since the operation began; the first tick ends at one time step
    double visibility;  // of the ROI, 0 to 1, as the robot measures it in the endoscope's picture
    double visibility_world;  // the same by rays in the simulated truth; NAN without a truth
    // N, by the twin, the larger of both arms: pull less the weight carried; NAN: it has no forces
    double force;
    double force_world;  // N, the same in the simulated truth; NAN without a truth
    double height;       // m, the higher of the arms that hold tissue, over where it was grasped
    double speed_rate;   // 1, or less while slowed down by force
    double mu;           // m, OmMonitorFrame.mu of the last frame; NAN: there is none
    int warning;         // state of Alg. 5, 0 while nothing is held
} OmRetractSample;"""
    time: float
    visibility: float
    visibility_world: float
    force: float
    force_world: float
    height: float
    speed_rate: float
    mu: float
    warning: int


class OmRetractAction(Struct):
    """typedef struct OmRetractAction {  // one executed action
    OmPlanVerb verb;
    int arm, block;     // block -1: none
    double begin, end;  // s of the operation
    OmActionOutcome outcome;
    double visibility;       // at its end
    double force_max;        // N, during it, by the twin
    double force_world_max;  // N, during it, in the truth; NAN without a truth
    bool is_replanned;       // a new plan starts with it
    int plan;                // which plan, from 0
    double turn;  // rad, of the wrist, since a joint forbade the usual orientation; 0: none
} OmRetractAction;"""
    verb: Choice[OmPlanVerb]
    arm: int
    block: int
    begin: float
    end: float
    outcome: Choice[OmActionOutcome]
    visibility: float
    force_max: float
    force_world_max: float
    is_replanned: bool
    plan: int
    turn: float


class OmRetractUpdate(Struct):
    """typedef struct OmRetractUpdate {  // one estimate of the twin's attachments
    // adopted, followed, refused or cancelled; started while it runs
    OmUpdateStage stage;
    bool is_followed;          // also of an adopted estimate whose effect was too small
    char reason[256];          // of a refusal
    int nacquisition;          // that it was made from
    int start_tick, end_tick;  // end_tick: of adoption or refusal, -1: none, also if cancelled
    double start, end;         // s of the operation
    int nattached_before, nattached_after;  // vertices of the twin
    double seen_share;                      // OmMatchEstimate.seen_share
    double before_median, after_median;     // m, of the scan from the twin
    double estimate_ms;                     // wall time; NAN if cancelled
    // m, mu when the estimate was started, and when the twin had adopted it, or it was refused; NAN: not measured
    double mu_before, mu_after;
    // m, the same of OmMonitorFrame.part, less its value before the grasp
    double part_before, part_after;
} OmRetractUpdate;"""
    stage: Choice[OmUpdateStage]
    is_followed: bool
    reason: str
    nacquisition: int
    start_tick: int
    end_tick: int
    start: float
    end: float
    nattached_before: int
    nattached_after: int
    seen_share: float
    before_median: float
    after_median: float
    estimate_ms: float
    mu_before: float
    mu_after: float
    part_before: float
    part_after: float


class OmRetractResult(Struct):
    """typedef struct OmRetractResult {  // om_retract_result_done frees
    OmRetractOutcome outcome;     //
    bool is_exposed;              // the outcome is OM_RETRACT_EXPOSED
    char reason[256];             // one sentence: how it ended
    double visibility_start, visibility_end;
    double visibility_world_end;  // in the truth: this one judges; NAN without a truth
    // Forces: the arms act on the twin's forces only. The truth's forces are for evaluation; NAN without a truth.
    double force_max;        // N, by the twin; NAN if its engine has no forces
    double force_world_max;  // N, in the truth
    double force_more;       // N, largest excess of the truth over the twin at one instant
    double force_less;       // N, largest excess of the twin over the truth at one instant
    // Factor on the twin's forces, learnt where the arms measure force; 1: nothing was learnt. `force` has it.
    double force_factor;
    // Factor on the twin's Young's modulus, and times that it was learnt anew; 1: nothing was learnt.
    double young_factor;
    int nmodulus;
    bool is_modulus_by_shape;  // the last time by what the camera saw, not by forces
    int nforce;        // times the twin's force rose to where the arms act: threshold less margin
    int nforce_world;  // times the truth's force rose above the threshold
    double time;       // s of the operation
    // m, way of both tips in reaches, pulls and folds, between measured places
    double path;
    double wall_time;     // s it took here
    double twin_step_ms;  // mean wall time of a twin step
    int nplan;            // plans made
    int nahead;           // grasping points tried by looking ahead
    int64_t nahead_step;  // steps of the twin that this took
    double plan_ms_median, plan_ms_max;
    int naction;
    OmRetractAction* action;
    int nsample;
    OmRetractSample* sample;
    OmHold hold;      // the last one; OM_HOLD_NONE: there was none
    int nhold;        // times that the loop held
    int ncommand;     // of a person or a program, but pause and resume
    int nmonitor;     // frames compared with the twin
    int nwarning[3];  // times that the warning state rose to 1, 2, 3
    double mu_max;    // m, while tissue was held; 0 without a monitor
    int nslip;        // grasps that slipped
    int nempty;       // times that a jaw closed on nothing
    // Reaches to tissue that the depth camera sees, more than OM_CLOUD_AGREE from where the twin has it.
    int nmeasured;
    double measured_off;  // m, the largest such distance
    int ndrawn;        // grasps at which the twin's tissue was not at the tip, and was drawn to it
    int world_ntorn;   // attached vertices that tore off in the truth
    int nacquisition;  // taken during the operation
    int nupdate;       // estimates
    OmRetractUpdate* update;
    // The tissue comes to rest on its ground before the operation begins.
    bool is_settled;  // twin and world were at rest when the operation began
    // m, mean displacement of the vertices until then; NAN without a truth
    double twin_shift, world_shift;
    int nadded;  // vertices that were attached to the twin, which slid off without them (om_retract_run)
    bool has_slid;  // one of the shifts exceeds OM_RETRACT_SLID of the tissue's smaller half extent
    int twin_nbad, world_nbad;  // steps with inverted elements, unsettled contact or energy gained
    int twin_nvert, twin_ntet, world_nvert, world_ntet;  // of the world 0 without a truth
    uint64_t hash;  // of the truth's final state; of the twin's without a truth
} OmRetractResult;"""
    outcome: Choice[OmRetractOutcome]
    is_exposed: bool
    reason: str
    visibility_start: float
    visibility_end: float
    visibility_world_end: float
    force_max: float
    force_world_max: float
    force_more: float
    force_less: float
    force_factor: float
    young_factor: float
    nmodulus: int
    is_modulus_by_shape: bool
    nforce: int
    nforce_world: int
    time: float
    path: float
    wall_time: float
    twin_step_ms: float
    nplan: int
    nahead: int
    nahead_step: int
    plan_ms_median: float
    plan_ms_max: float
    naction: int
    action: Any
    nsample: int
    sample: Any
    hold: Choice[OmHold]
    nhold: int
    ncommand: int
    nmonitor: int
    nwarning: Numbers
    mu_max: float
    nslip: int
    nempty: int
    nmeasured: int
    measured_off: float
    ndrawn: int
    world_ntorn: int
    nacquisition: int
    nupdate: int
    update: Any
    is_settled: bool
    twin_shift: float
    world_shift: float
    nadded: int
    has_slid: bool
    twin_nbad: int
    world_nbad: int
    twin_nvert: int
    twin_ntet: int
    world_nvert: int
    world_ntet: int
    hash: int


class OmLoopMotion(Struct):
    """typedef struct OmLoopMotion {  // a motion under way; positions in m, task frame: z is up
    int arm;
    OmPlanVerb verb;  // OM_PLAN_REACH: the tool is free; OM_PLAN_PULL: it holds tissue
    OmVec3 tip;       // as measured
    OmVec3 goal;      // where it ends
    int nplace;       // places that the law has given so far
} OmLoopMotion;"""
    arm: int
    verb: Choice[OmPlanVerb]
    tip: Numbers
    goal: Numbers
    nplace: int


class OmMotionLaw(Struct):
    """typedef struct OmMotionLaw {
    void* ctx;  // borrowed
    /// The next place of the tip, at most OM_LAW_STEP from it; the goal: the rest of the way is straight.
    /// A negative status ends the run with this error.
    OmStatus (*next)(void* ctx, const OmLoopMotion* motion, OmVec3* place);
} OmMotionLaw;"""
    ctx: Any
    next: Any


class OmLoopListener(Struct):
    """typedef struct OmLoopListener {
    void* ctx;  // first argument of every function; borrowed
    OmStatus (*on_begin)(void* ctx, const OmLoop* loop);  // before the first tick
    OmStatus (*on_tick)(void* ctx, const OmLoop* loop, const OmRetractSample* now);
    OmStatus (*on_plan)(void* ctx, const OmLoop* loop, const OmSituation* situation,
                        const OmPlan* plan);  // also of a plan without actions
    OmStatus (*on_action_begin)(void* ctx, const OmLoop* loop, const OmPlanAction* action);
    OmStatus (*on_action_end)(void* ctx, const OmLoop* loop, const OmRetractAction* action);
    OmStatus (*on_end)(void* ctx, const OmLoop* loop, const OmRetractResult* result);
    OmStatus (*on_update)(void* ctx, const OmLoop* loop, const OmUpdateEvent* event);
    OmStatus (*on_command)(void* ctx, const OmLoop* loop, const OmLoopCommand* command);
    OmStatus (*on_hold)(void* ctx, const OmLoop* loop, OmHold hold, const char* reason);
    // the warning state changed from `was` to om_loop_warning
    OmStatus (*on_warning)(void* ctx, const OmLoop* loop, int was, const OmMonitorFrame* frame);
} OmLoopListener;"""
    ctx: Any
    on_begin: Any
    on_tick: Any
    on_plan: Any
    on_action_begin: Any
    on_action_end: Any
    on_end: Any
    on_update: Any
    on_command: Any
    on_hold: Any
    on_warning: Any


class OmLoopDef(Struct):
    """typedef struct OmLoopDef {
    OmCookie cookie;
    const OmSceneTask* task;  // limits, speeds and grid; copied
    OmWorld* world;      // borrowed, at its start (om_world_reset); its clock may show any time
    OmBody* twin;        // borrowed, at rest
    OmPlanner* planner;  // borrowed
    OmBody* truth;       // borrowed; recorded, never acted on; default null: there is none
    const OmLoopListener* listener;  // called in this order; copied
    int nlistener;                   // default 0, at most OM_LOOP_MAX_LISTENER
    // Corrects the twin's attachments; borrowed until the loop is destroyed; default null. The world must observe
    // depth.
    OmUpdater* updater;
    // The plan before the operation, of the same grid; copied; default null. It is followed first, and what it tried is
    // known to the planner until the twin's attachments change.
    const OmPreplan* preplan;
    // Grasping points are the twin's alone, also where the depth camera sees the tissue elsewhere; default false.
    bool is_by_twin;
    OmAhead* ahead;  // tries grasping points of the twin before a new plan; borrowed; default null
    // Learns the twin's Young's modulus, by measured forces or by what the monitor sees. Borrowed; default null. The
    // twin must be of om_body_create.
    OmModulus* modulus;
    OmMotionLaw law;  // of reaches and pulls; default: straight lines
    // Compares the twin with the depth camera; borrowed; default null. The world must observe depth. With a monitor
    // acquisitions are taken in warning states 1 and 2 alone (Alg. 5), without one after every pull and fold.
    OmMonitor* monitor;
    // A person watches: a hold waits for OM_LOOP_RESUME or OM_LOOP_ABORT. Default false: a hold ends the loop.
    bool is_attended;
    bool needs_approval;  // each plan waits for OM_LOOP_APPROVE or OM_LOOP_REJECT; default false
    // s: the loop holds when a measurement is older, or when the world's clock stands still for longer; default 0.2;
    // 0: not watched
    double max_age;
    // s by which the operation may be behind the clock on the wall, for a world that does not wait, as a real robot;
    // default 0: not watched
    double max_lag;
    bool is_settled;  // twin and world are at rest; default true; recorded in the result
    int nadded;  // vertices attached to a twin that slid off; default 0; recorded in the result
    double wall_begin;  // om_clock_now() from which OmRetractResult.wall_time counts; default: now
} OmLoopDef;"""
    cookie: int
    task: Any
    world: Any
    twin: Any
    planner: Any
    truth: Any
    listener: Any
    nlistener: int
    updater: Any
    preplan: Any
    is_by_twin: bool
    ahead: Any
    modulus: Any
    law: OmMotionLaw
    monitor: Any
    is_attended: bool
    needs_approval: bool
    max_age: float
    max_lag: float
    is_settled: bool
    nadded: int
    wall_begin: float


class OmLoopCommand(Struct):
    kind: Choice[OmLoopCommandKind]
    block: int
    value: float


class OmRetractDef(Struct):
    """typedef struct OmRetractDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed
    const char* out_dir;   // written whole (om_folder_begin); null: nothing is written
    const char* program;   // a logic program in place of the built-in one, or null
    int frame_every;       // a picture in the report every so many actions, 0 none; default 1
    int nworker;           // default 0: one a processor
    // The plan before the operation; borrowed; default null: the planner makes the first one, too.
    const OmPreplan* preplan;
    // A person watches the loop (OmLoopDef.is_attended): called after every tick, and gives commands by
    // om_loop_command. An error ends the run. Default null.
    OmStatus (*supervise)(void* ctx, OmLoop* loop);
    void* supervise_ctx;
    OmMotionLaw law;      // OmLoopDef.law; not with records_observations; default: straight lines
    bool has_both_arms;   // OmPlannerDef.has_both_arms; default false
    bool needs_approval;  // each plan waits for the person; default false
    // Write every acquisition to out_dir/acquisitions (om_acquisition_save); default false. The run is unchanged.
    bool records_acquisitions;
    // Write run.vtkhdf; default true. False where several threads of a program make runs: HDF5 is for one thread.
    bool has_recording;
    // Write all that the loop observes to out_dir/observations.log, for om_retract_replay; default false. Depth is then
    // rounded to 0.1 mm before the loop gets it (world_log.h).
    bool records_observations;
} OmRetractDef;"""
    cookie: int
    scene: Any
    out_dir: bytes | None
    program: bytes | None
    frame_every: int
    nworker: int
    preplan: Any
    supervise: Any
    supervise_ctx: Any
    law: OmMotionLaw
    has_both_arms: bool
    needs_approval: bool
    records_acquisitions: bool
    has_recording: bool
    records_observations: bool


class OmRetractEstimate(Struct):
    """typedef struct OmRetractEstimate {  // of a run that has not begun
    int twin_nvert, twin_ntet, world_nvert, world_ntet;
    int twin_nattached, world_nattached;  // vertices
    // blocks of the grid; those with a grasping point that is not above an attachment
    int nblock, ngrasp;
    double visibility;  // of the ROI before any action, 0 to 1
    bool is_settled;    // as in OmRetractResult
    bool has_slid;      //
    int nplanned;       // actions of the first plan; 0: none is found
    double begin_time;  // s to build, settle and plan
    // s of computing for one of operation, measured over OM_RETRACT_CHECK_TIME at rest
    double time_rate;
    // memory that the report's pictures take if every action of the scene is used
    double picture_bytes;
} OmRetractEstimate;"""
    twin_nvert: int
    twin_ntet: int
    world_nvert: int
    world_ntet: int
    twin_nattached: int
    world_nattached: int
    nblock: int
    ngrasp: int
    visibility: float
    is_settled: bool
    has_slid: bool
    nplanned: int
    begin_time: float
    time_rate: float
    picture_bytes: float


class OmForceCalibration(Struct):
    """typedef struct OmForceCalibration {
    int nrun;                                            // grasps that held tissue
    double median, lower_quartile, upper_quartile, max;  // N, of the largest pulls
    double threshold;                                    // N, 2 x median
    double margin;                                       // N, for OmSceneTask.force_margin
    double more_median;                                  // N, the median of truth less twin
    int npair;  // instants at which truth and twin were compared
} OmForceCalibration;"""
    nrun: int
    median: float
    lower_quartile: float
    upper_quartile: float
    max: float
    threshold: float
    margin: float
    more_median: float
    npair: int


class OmSearchResult(Struct):
    """typedef struct OmSearchResult {
    int ngrasp, nsequence;     // grasping points and sequences tried
    int nexposed;              // sequences that exposed the ROI
    int first_block;           // that the other arm holds meanwhile; -1: one arm
    double visibility;         // the largest of all sequences, 0 to 1
    double force;              // N, the largest pull of that sequence, in the truth
    int block;                 // grasping point of that sequence, -1: nothing can be grasped
    OmPlanVerb first, second;  // folds of that sequence; OM_PLAN_PULL: none
    int naction;  // fewest actions of a sequence that exposes the ROI, with reach and grasp; 0: none
} OmSearchResult;"""
    ngrasp: int
    nsequence: int
    nexposed: int
    first_block: int
    visibility: float
    force: float
    block: int
    first: Choice[OmPlanVerb]
    second: Choice[OmPlanVerb]
    naction: int


class OmAuditDef(Struct):
    """typedef struct OmAuditDef {
    OmCookie cookie;
    OmPlanner* planner;      // explains the plans, borrowed; null: without reasons
    const char* path;        // of a new file; null (default): the text is only kept in memory
    const char* scene_text;  // hashed, as the two below; default ""
    const char* program;     // text of the logic program; default the built-in one
    uint64_t network_hash;   // om_banet_net_hash; default 0: none
} OmAuditDef;"""
    cookie: int
    planner: Any
    path: bytes | None
    scene_text: bytes | None
    program: bytes | None
    network_hash: int


class OmRecorderDef(Struct):
    """typedef struct OmRecorderDef {
    OmCookie cookie;
    const char* out_dir;   // written whole (om_folder_begin); copied
    const OmScene* scene;  // borrowed, as all below
    OmWorld* world;        //
    OmBody* twin;          //
    OmPlanner* planner;    // explains the plans
    OmBody* truth;         // default null: none
    int frame_every;       // a picture every so many actions, 0 none; default 1
    // write the acquisitions of the loop's updater to out_dir/acquisitions; default false
    bool records_acquisitions;
    bool has_recording;  // write run.vtkhdf; default true; false where several threads record runs
} OmRecorderDef;"""
    cookie: int
    out_dir: bytes | None
    scene: Any
    world: Any
    twin: Any
    planner: Any
    truth: Any
    frame_every: int
    records_acquisitions: bool
    has_recording: bool


class OmReplayDef(Struct):
    """typedef struct OmReplayDef {
    OmCookie cookie;
    const char* dir;   // of the run
    const char* path;  // the replay's audit is written there; null (default): not written
    const struct OmEngineSet* engines;  // that the scene may name; null (default): those of OmScene
    int nworker;                        // default 0: one a processor
} OmReplayDef;"""
    cookie: int
    dir: bytes | None
    path: bytes | None
    engines: Any
    nworker: int


class OmReplayResult(Struct):
    """typedef struct OmReplayResult {  // om_replay_result_done frees
    bool is_same;
    int nline;          // lines of the run's audit
    int ndecision;      // plans among them
    double time;        // s of the operation that was replayed
    int line;           // the first line that differs, counted from 1; 0: none
    char* was;          // this line in the run; "" behind its end
    char* now;          // in the replay
    char reason[1024];  // one sentence: the outcome
} OmReplayResult;"""
    is_same: bool
    nline: int
    ndecision: int
    time: float
    line: int
    was: bytes | None
    now: bytes | None
    reason: str


class OmFemGrid(Struct):
    """typedef struct OmFemGrid {  // om_fem_grid_done frees
    OmGrid grid;            // of the points
    int npoint;             //
    OmFemMesh mesh;         // OM_HEX8; rest positions of the nodes
    int* cell_elem;         // element of a cell, or -1                                    (npoint)
    int* point_node;        // node at a point, or -1                                      (npoint)
    int* node_point;        // point of a node                                         (mesh.nnode)
    unsigned char* fixed;   // 1: the node does not move; 0 after init                 (mesh.nnode)
} OmFemGrid;"""
    grid: OmGrid
    npoint: int
    mesh: OmFemMesh
    cell_elem: Any
    point_node: Any
    node_point: Any
    fixed: Any


class OmFemGridPatch(Struct):
    """typedef struct OmFemGridPatch {  // prescribed nodes; om_fem_grid_patch_done frees
    int num;                     // their unknowns
    double* factor;              // Cholesky factor of the patch's compliance     (num x num)
    const float** column;        // their columns of the compliance, borrowed           (num)
    int* dof;                    // 3 * node + component                                (num)
} OmFemGridPatch;"""
    num: int
    factor: Any
    column: Any
    dof: Any


class OmFemGridStop(Struct):
    """typedef struct OmFemGridStop {  // when a solve ends
    double tolerance;           // of the estimated mean distance to equilibrium, m
    int max_cycle;              // 0: u is not changed
    int nworker;                // threads, 0: one per processor; the result does not depend on it
} OmFemGridStop;"""
    tolerance: float
    max_cycle: int
    nworker: int


class OmFemGridReport(Struct):
    """typedef struct OmFemGridReport {
    int ncycle;         // cycles made; with 0 the other fields are 0
    double left;        // estimated mean distance to equilibrium, m
    double min_volume;  // smallest det F at a Gauss point; not above 0: an element is inverted
} OmFemGridReport;"""
    ncycle: int
    left: float
    min_volume: float


class OmFemGridUntangling(Struct):
    """typedef struct OmFemGridUntangling {
    int ninverted;      // tetrahedra that were inverted before
    int nmoved;         // nodes moved by more than 0.01 mm
    double max, mean;   // displacement by untangling: largest, and mean over all nodes, m
    double min_volume;  // smallest det F of a tetrahedron afterwards
} OmFemGridUntangling;"""
    ninverted: int
    nmoved: int
    max: float
    mean: float
    min_volume: float


class OmSpring(Struct):
    """typedef struct OmSpring {  // from the vertex in whose list it is
    int vert;              // its other end
    double stiffness;      // N/m
    double length;         // at rest, m
} OmSpring;"""
    vert: int
    stiffness: float
    length: float


class OmChainDef(Struct):
    """typedef struct OmChainDef {  // made by om_chain_default_def; copied by om_tissue_create
    double stretch;   // largest elongation of a link over its rest length, 0 to 10; default 0.1
    double compress;  // largest shortening over its rest length, from 0 to below 1; default 0.1
    double shear;     // largest sideways displacement over its rest length, 0 to 10; default 0.1
    // How far a vertex moves towards the mean of its neighbours in an iteration: 0 (not at all) to
    // 1 (default).
    double relaxation;
    int sweeps;       // of relaxation in a step, 0 to 1000; default 10
    OmCookie cookie;  // set by om_chain_default_def
} OmChainDef;"""
    stretch: float
    compress: float
    shear: float
    relaxation: float
    sweeps: int
    cookie: int


class OmMeshFrame(Struct):
    """typedef struct OmMeshFrame {  // of the numbers in a file; zero says nothing
    double unit;              // m per unit; 0: not stated
    OmSpace space;
} OmMeshFrame;"""
    unit: float
    space: Choice[OmSpace]


class OmSurfaceCheck(Struct):
    """typedef struct OmSurfaceCheck {
    int nopen_edge;      // edges of one triangle: holes
    int nmanifold_edge;  // edges of three or more triangles
    int nflipped_edge;   // edges whose two triangles disagree on the outside
    int ncomponent;      // pieces connected by edges
    int neuler;          // V - E + F of the vertices in use; 2 for a sphere
    int first_edge[2];   // vertices of the first offending edge, -1 if none
    int first_tri;       // its triangle, -1 if none
} OmSurfaceCheck;"""
    nopen_edge: int
    nmanifold_edge: int
    nflipped_edge: int
    ncomponent: int
    neuler: int
    first_edge: Numbers
    first_tri: int


class OmMeshArray(Struct):
    """typedef struct OmMeshArray {  // values on the vertices or elements of a mesh; borrowed
    const char* name;
    OmArrayType type;   // of what `value` points at: double, float, int (32 bits), unsigned char
    int ncomp;          // components, 1 to 9
    bool is_cell;       // of elements, not of vertices
    const void* value;  // (nvert or ntet x ncomp)
} OmMeshArray;"""
    name: bytes | None
    type: Choice[OmArrayType]
    ncomp: int
    is_cell: bool
    value: Any


class OmRecordingArrays(Struct):
    """typedef struct OmRecordingArrays {
    const OmMeshArray* array;
    int narray;
} OmRecordingArrays;"""
    array: Any
    narray: int


class OmRecordedSurface(Struct):
    """typedef struct OmRecordedSurface {  // borrowed until om_recording_begin_scene returns
    const char* name;
    const OmSurface* surface;  // its x is not recorded
} OmRecordedSurface;"""
    name: bytes | None
    surface: Any


class OmAcquisitionFile(Struct):
    """typedef struct OmAcquisitionFile {  // the keys of a file, in SI
    char path[512];                 // of the file, for messages
    char cloud[512];                // relative to the folder of the file; "": a frame of a series
    char series[512];               // the same; "": none
    int frame_index;                // of the series, from 0
    int grasp_frame[OM_MAX_ARM];    // frame in which the jaw closed; -1: `grasp` has the poses
    OmMeshFrame frame;  // of the cloud; zero: as the cloud says, else millimetres and RAS
    int registered;     // OmRegistered; default OM_REGISTERED_YES
    double time;        // s; default 0
    double noise;       // m, of a point along its ray; default 0: not known
    bool has_camera;
    OmCamera camera;
    int ngrasp;
    OmMatchGrasp grasp[OM_MAX_ARM];  // nvert is 0
} OmAcquisitionFile;"""
    path: str
    cloud: str
    series: str
    frame_index: int
    grasp_frame: Numbers
    frame: OmMeshFrame
    registered: int
    time: float
    noise: float
    has_camera: bool
    camera: OmCamera
    ngrasp: int
    grasp: Any


class OmRegisterDef(Struct):
    """typedef struct OmRegisterDef {
    OmCookie cookie;  // set by om_register_default_def
    bool has_start;   // pose_model_scan is known roughly; default false: principal axes
    // maps points of the scan (world) to the frame of the model; default identity
    OmPose pose_model_scan;
    // The start may be off by this much: a turn about the scan's centre, rad, default 30 degrees, and a shift, m,
    // default 30 mm. Both 0: no other starts are tried.
    double start_angle, start_shift;
    int npoint;          // points of the scan that are used, 100 to 100000; default 2000
    double min_overlap;  // smallest share of the scan that lies on the model, 0.2 to 1; default 0.6
    double max_residual;  // m, of the median residual; default 2 mm
    // Largest standard deviations of a reliable pose, rad and m; defaults 0.2 degrees and 0.2 mm.
    double max_sigma_angle, max_sigma_shift;
    int nworker;  // default 0: one a processor; the result does not depend on it
} OmRegisterDef;"""
    cookie: int
    has_start: bool
    pose_model_scan: OmPose
    start_angle: float
    start_shift: float
    npoint: int
    min_overlap: float
    max_residual: float
    max_sigma_angle: float
    max_sigma_shift: float
    nworker: int


class OmRegistration(Struct):
    """typedef struct OmRegistration {
    OmPose pose_model_scan;  // maps points of the scan (world) to the frame of the model
    double residual;         // median distance of the kept points to the model's tangent planes, m
    double overlap;          // share of the points that were kept, 0 to 1
    // Standard deviation in the least known direction: a turn about the scan's centre, rad, a shift of this centre, m
    double sigma_angle, sigma_shift;
    OmVec3 axis_angle, axis_shift;  // this direction in the frame of the model, unit
    OmVec3 center;                  // of the scan's points, world, m
    bool is_reliable;        // false: `reason` says why not, pose_model_scan is the best found
    char reason[256];        // "" if reliable
    int nstart, niteration;  // starts tried; iterations of all of them
    double ms;               // wall clock
} OmRegistration;"""
    pose_model_scan: OmPose
    residual: float
    overlap: float
    sigma_angle: float
    sigma_shift: float
    axis_angle: Numbers
    axis_shift: Numbers
    center: Numbers
    is_reliable: bool
    reason: str
    nstart: int
    niteration: int
    ms: float


class OmMatchReport(Struct):
    """typedef struct OmMatchReport {  // all borrowed
    const char* title;
    const OmSite* site;
    const OmMatch* match;
    int nacquisition;
    const OmAcquisition* acquisition;
    const char* const* name;  // of the acquisitions
    // of the acquisitions; nstart 0: not registered here; null: none is
    const OmRegistration* registration;
    const OmMatchEstimate* estimate;  // null: there is none, `reason` says why
    const char* reason;
    double load_ms, build_ms, register_ms;  // times of the stages before the update
} OmMatchReport;"""
    title: bytes | None
    site: Any
    match: Any
    nacquisition: int
    acquisition: Any
    name: Any
    registration: Any
    estimate: Any
    reason: bytes | None
    load_ms: float
    build_ms: float
    register_ms: float


class OmPointCloud(Struct):
    """typedef struct OmPointCloud {  // om_point_cloud_done frees
    int npoint, ntri;          //
    double* x;       // m                                                        (npoint x 3)
    double* normal;  // of length 1, or 0 where the file has none; null: no normals  (npoint x 3)
    int* tri_vert;   // points                                                   (ntri x 3)
    int nduplicate;  // points of the file at the place of an earlier one: merged with it
    int ndropped;    // points of the file that are not finite: left out, with their triangles
} OmPointCloud;"""
    npoint: int
    ntri: int
    x: Any
    normal: Any
    tri_vert: Any
    nduplicate: int
    ndropped: int


class OmScanFileDef(Struct):
    """typedef struct OmScanFileDef {
    OmCookie cookie;         // set by om_scan_file_default_def
    OmMeshFrame frame;       // unit and space of the file; default: what it states, else mm and RAS
    OmPose pose_world_file;  // maps the file's coordinates, in m, to the world; default identity
    bool has_eye;            // default false
    OmVec3 eye;              // place of the camera, world frame, m
    OmVec3 up;               // without a camera most normals of a piece point up; default +z
    double spacing;  // m, mean distance of neighbouring points that are kept; 0 (default): all are
    double noise;    // m, of a point of the file, for OmScan.noise; default 0: not known
} OmScanFileDef;"""
    cookie: int
    frame: OmMeshFrame
    pose_world_file: OmPose
    has_eye: bool
    eye: Numbers
    up: Numbers
    spacing: float
    noise: float


class OmScanFileReport(Struct):
    """typedef struct OmScanFileReport {
    int npoint;      // points of the file
    int nduplicate;  // merged with an equal point
    int ndropped;    // left out: not finite
    int nestimated;  // normals that were estimated
    int nthinned;    // left out by OmScanFileDef.spacing
} OmScanFileReport;"""
    npoint: int
    nduplicate: int
    ndropped: int
    nestimated: int
    nthinned: int


class OmScanFit(Struct):
    """typedef struct OmScanFit {  // sizes of a scan and a model
    double ratio;           // diagonal of the scan's box over that of the model's
    double gap;             // m, between their boxes; 0: they overlap
} OmScanFit;"""
    ratio: float
    gap: float


class OmCsr(Struct):
    """typedef struct OmCsr {  // a square sparse matrix; om_csr_done frees
    int n;              // rows and columns
    int* row_adr;       // first entry of each row                        (n + 1)
    int* col;           // column of each entry, ascending in a row       (row_adr[n])
    double* value;      //                                                (row_adr[n])
} OmCsr;"""
    n: int
    row_adr: Any
    col: Any
    value: Any


class OmEigenDef(Struct):
    """typedef struct OmEigenDef {  // made by om_eigen_default_def
    int npair;               // eigenpairs, 1 to n - 1
    // Below the smallest eigenvalue: A - shift B must be positive definite. Best about as far below it as the
    // eigenvalues lie apart.
    double shift;
    double tolerance;  // relative to an eigenvalue's distance from the shift; default 1e-10
    int max_restarts;  // of a run, >= 1; default 300
    int nbasis;  // Lanczos vectors, npair < nbasis <= n; 0: min(n, max(2 npair, 20)); default 0
    OmCookie cookie;  // set by om_eigen_default_def
} OmEigenDef;"""
    npair: int
    shift: float
    tolerance: float
    max_restarts: int
    nbasis: int
    cookie: int


class OmEigenInfo(Struct):
    """typedef struct OmEigenInfo {
    int npair;        // converged
    int nsolve;       // solves with A - shift B
    double residual;  // largest |A x - lambda B x| / |(lambda - shift) B x|
} OmEigenInfo;"""
    npair: int
    nsolve: int
    residual: float


class OmLaplacian(Struct):
    """typedef struct OmLaplacian {  // om_laplacian_done frees
    // Integrals of grad f_i . grad f_j: positive semidefinite, rows sum to 0; no unit.
    OmCsr stiffness;
    double* area;  // of the vertices, m^2; 0: no triangle uses the vertex             (stiffness.n)
    double total_area;  // m^2
    int nflip;          // edges flipped until every edge was intrinsic Delaunay
    double added;       // m, added to every edge so that no triangle is degenerate
} OmLaplacian;"""
    stiffness: OmCsr
    area: Any
    total_area: float
    nflip: int
    added: float


class OmSpectralBasis(Struct):
    """typedef struct OmSpectralBasis {  // constant once made; om_spectral_basis_done frees
    int nvert;                    // vertices of the shape
    int nrow;                     // vertices with an area: they have a row below
    int npair;                    // eigenpairs
    int* vert;                    // vertex of each row, ascending                (nrow)
    int* row;                     // row of each vertex, or -1                    (nvert)
    double* area;                 // of each row, m^2                             (nrow)
    double total_area;            // m^2
    double* eigenvalue;           // ascending, from about 0, 1/m^2               (npair)
    // Eigenvectors, by rows of vertices; the mean of phi_i phi_j over the area is 1 if i = j, else 0.
    double* phi;     // (nrow x npair)
    double seconds;  // that it took
} OmSpectralBasis;"""
    nvert: int
    nrow: int
    npair: int
    vert: Any
    row: Any
    area: Any
    total_area: float
    eigenvalue: Any
    phi: Any
    seconds: float


class OmSpectralDef(Struct):
    """typedef struct OmSpectralDef {  // made by om_spectral_default_def
    int first, last, step;      // functions of b in the rounds, >= 1; default 10, 60, 5
    // b is a part of a: a has more functions below the same frequency, and as many of them are used (the slanted
    // matrix of Rodola et al. 2017). Needs a basis of a with about last x area of a / area of b functions; if it
    // has fewer, b uses fewer. Default false: as many of a as of b.
    bool is_partial;
    int nworker;  // threads, 0 is one per processor; the result does not depend on it; default 0
    OmCookie cookie;
} OmSpectralDef;"""
    first: int
    last: int
    step: int
    is_partial: bool
    nworker: int
    cookie: int


class OmSpectralReport(Struct):
    """typedef struct OmSpectralReport {
    int nround;
    int npair_a, npair_b;  // functions of the last round
    // |C^T C - 1| / sqrt(columns) of the last round; 0: the map keeps areas.
    double orthogonality;
    double seconds;
} OmSpectralReport;"""
    nround: int
    npair_a: int
    npair_b: int
    orthogonality: float
    seconds: float


class OmTextPair(Struct):
    """typedef struct OmTextPair {  // a line of a file's metadata, UTF-8
    const char* key;
    const char* value;
} OmTextPair;"""
    key: bytes | None
    value: bytes | None


class OmFacts(Struct):
    """typedef struct
    OmFacts {  // lines of metadata with strings of their own; zero-initialise, om_facts_done frees
    int n;
    OmTextPair pair[OM_FACTS_MAX];
} OmFacts;"""
    n: int
    pair: Any


class OmTensor(Struct):
    """typedef struct OmTensor {  // of a file, or to be written; everything in it is borrowed
    const char* name;
    OmTensorType type;
    int rank;                         // 0 is a single value
    int64_t dim[OM_TENSOR_MAX_RANK];  // the last runs fastest
    // Written: float (OM_TENSOR_F32) or double (OM_TENSOR_F64). Read: little-endian bytes.
    const void* data;
} OmTensor;"""
    name: bytes | None
    type: Choice[OmTensorType]
    rank: int
    dim: Numbers
    data: Any


class OmStoreField(Struct):
    """typedef struct OmStoreField {
    const char *name, *unit;
    size_t offset;  // of the member
    OmStoreType type;
    int n;  // values
} OmStoreField;"""
    name: bytes | None
    unit: bytes | None
    offset: int
    type: Choice[OmStoreType]
    n: int


class OmPbdDef(Struct):
    """typedef struct OmPbdDef {    // made by om_pbd_default_def; lengths in m; copied by om_tissue_create
    OmPbdKind kind;          // default OM_PBD_CLUSTERS
    int substeps;            // of a step, 1 to 1000; default 0: chosen, see om_pbd_substeps
    int iterations;          // of a substep, 1 to 1000; default 9, else 1
    double damping;          // viscous drag on velocities, 1/s, >= 0; default 12, else 0
    double max_speed;        // of a particle, m/s, > 0; default 10
    double particle_volume;  // m^3, of each, where the mesh has no elements; default 0: not known
    // clusters
    double cluster_spacing;    // between centres, > 0; default 12.7 mm (5.4.1)
    double cluster_radius;     // at least half the spacing; default 9.5 mm
    double cluster_stiffness;  // alpha of (3.14), 0 to 1; default 0.361
    double linear_stretch;     // 0 to 1: goals follow the cluster's best linear map of the same
                               // volume by that share (Mueller et al. 2005); default 0: rigid
    // elements
    // Of OM_PBD_ELASTIC, s: ratio of the shear stress of the strain rate to that of the strain;
    // rayleigh_stiffness of OmTissueDef where that is larger. 0: none. Default -1: only energy
    // gained within a step is damped, with the time of two steps; steady motions are not damped.
    // Used without rayleigh_stiffness.
    double internal_friction;
    // lengths
    double edge_stiffness;    // of each edge, N/m, > 0; default 10
    double volume_stiffness;  // K of K/2 (V - V0)^2 / V0, Pa; 0: volumes are free; default 1e4
    // contact
    double collision_distance;  // kept from obstacles and, with self_collision, between particles;
                                // 0 for particles that lie on the surface, as mesh vertices do;
                                // default 3 mm
    double recover_speed;       // m/s, at which particles that start inside come out; default 0.5
    double friction;            // Coulomb's, against obstacles without their own; default 0.35
    double particle_friction;   // Coulomb's, between particles; default 0.25
    bool has_self_collision;    // default true for OM_PBD_CLUSTERS
    OmCookie cookie;            // set by om_pbd_default_def
} OmPbdDef;"""
    kind: Choice[OmPbdKind]
    substeps: int
    iterations: int
    damping: float
    max_speed: float
    particle_volume: float
    cluster_spacing: float
    cluster_radius: float
    cluster_stiffness: float
    linear_stretch: float
    internal_friction: float
    edge_stiffness: float
    volume_stiffness: float
    collision_distance: float
    recover_speed: float
    friction: float
    particle_friction: float
    has_self_collision: bool
    cookie: int


class OmReport(Struct):
    """typedef struct OmReport {  // all fields are private
    OmText html;
    OmStatus status;    // the first failure; later calls do nothing
    char message[256];  // its sentence
    bool is_in_section;
    bool is_in_grid;  // pictures are being added
    bool is_in_fold;
    int nchart;
} OmReport;"""
    html: OmText
    status: Choice[OmStatus]
    message: str
    is_in_section: bool
    is_in_grid: bool
    is_in_fold: bool
    nchart: int


class OmReportSeries(Struct):
    """typedef struct OmReportSeries {
    const char* name;
    const double* x;  // ascending
    const double* y;  // values that are not finite leave a gap
    int n;
    bool is_step;  // a value holds until the next point
} OmReportSeries;"""
    name: bytes | None
    x: Any
    y: Any
    n: int
    is_step: bool


class OmReportSpan(Struct):
    """typedef struct OmReportSpan {  // an action from begin to end, named above the chart
    const char* label;
    double begin, end;
    bool is_bad;  // marked: the action failed
} OmReportSpan;"""
    label: bytes | None
    begin: float
    end: float
    is_bad: bool


class OmReportBox(Struct):
    """typedef struct OmReportBox {  // of a sample of n values; nothing is drawn where n is 0
    double min, lower, median, upper, max;  // ends of the whiskers, quartiles
    int n;
} OmReportBox;"""
    min: float
    lower: float
    median: float
    upper: float
    max: float
    n: int


class OmReportChart(Struct):
    """typedef struct OmReportChart {  // zero-initialise; unused fields stay 0
    const char* title;
    const char *x_label, *y_label;  // with units
    OmReportSeries series[OM_REPORT_MAX_SERIES];
    int nseries;
    bool has_limit;  // a dashed line at `limit`
    double limit;
    const char* limit_name;
    double limit2;  // another line, if it has a name
    const char* limit2_name;
    bool is_log_x, is_log_y;  // decades; values that are not above 0 leave a gap
    bool has_range;           // the y axis runs over [y_min, y_max] at least
    double y_min, y_max;
    const double* event;  // thin vertical lines at these x
    int nevent;
    const OmReportSpan* span;  // numbered from 1; named where there is room
    int nspan;
    // box plots instead of lines: ngroup groups along x, in each a box of every series (only its name is used)
    int ngroup;
    const char* const* group;  // names                     (ngroup)
    const OmReportBox* box;    //                (ngroup x nseries)
} OmReportChart;"""
    title: bytes | None
    x_label: bytes | None
    y_label: bytes | None
    series: Any
    nseries: int
    has_limit: bool
    limit: float
    limit_name: bytes | None
    limit2: float
    limit2_name: bytes | None
    is_log_x: bool
    is_log_y: bool
    has_range: bool
    y_min: float
    y_max: float
    event: Any
    nevent: int
    span: Any
    nspan: int
    ngroup: int
    group: Any
    box: Any


class OmRlKey(Struct):
    """typedef struct OmRlKey {
    int key;                // a character, or OM_RL_KEY_UP and the following ones
    int component, choice;  // of the action
    const char* about;      // what it does
} OmRlKey;"""
    key: int
    component: int
    choice: int
    about: bytes | None


class OmRlTaskOps(Struct):
    """typedef struct OmRlTaskOps {
    void (*destroy)(OmRlTask* task);
    /// Memory of one environment; reset comes before any other call.
    OmStatus (*state_create)(const OmRlTask* task, void** state);
    void (*state_destroy)(const OmRlTask* task, void* state);
    /// Begin an episode. All that is drawn, also later in the episode, comes from `rng` (keep a copy).
    /// `start`: -1 draws one; 0 to nstart - 1 is a start of the evaluation.
    OmStatus (*reset)(const OmRlTask* task, void* state, OmRng rng, int start);
    /// One step. `action` is in range. The limit of steps is not the task's business.
    OmStatus (*step)(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated);
    /// Write nobservation finite values.
    void (*observe)(const OmRlTask* task, const void* state, float* obs);
    /// Write ninfo values. May be slow (a picture): called at the end of an episode and on request. Optional.
    OmStatus (*info)(const OmRlTask* task, void* state, double* value);
    /// Draw the scene into an empty picture, RGB. Its width and height, if they are set, are the wanted size. Optional.
    OmStatus (*render)(const OmRlTask* task, void* state, OmPicture* picture);
    /// The action of a scripted expert with the noise of a person; its noise comes from `rng`. Optional.
    void (*expert)(const OmRlTask* task, const void* state, OmRng* rng, int* action);
    /// Where the tip of a tool is, m. Optional; a task has all of tip, place and steer, or none.
    void (*tip)(const OmRlTask* task, const void* state, double tip[3]);
    /// Right after a reset: put the tip at a place. It stays off obstacles.
    /// @return OM_OK; OM_INVALID (outside of the workspace, or out of reach: nothing was changed)
    OmStatus (*place)(const OmRlTask* task, void* state, const double tip[3]);
    /// The action that brings the tip nearest to a place; is_closed: the wish of a gripper, if there is one.
    void (*steer)(const OmRlTask* task, const void* state, const double to[3], bool is_closed,
                  int* action);
    /// Bytes of a state: after restore every later step gives the bytes of the saved state. Where a state is one block
    /// of memory without pointers, save and restore may be null: the block is copied.
    size_t (*state_size)(const OmRlTask* task);
    void (*save)(const OmRlTask* task, const void* state, void* block);
    void (*restore)(const OmRlTask* task, void* state, const void* block);
} OmRlTaskOps;"""
    destroy: Any
    state_create: Any
    state_destroy: Any
    reset: Any
    step: Any
    observe: Any
    info: Any
    render: Any
    expert: Any
    tip: Any
    place: Any
    steer: Any
    state_size: Any
    save: Any
    restore: Any


class OmRlTask(Struct):
    ops: Any
    name: str
    nobservation: int
    picture_width: int
    picture_height: int
    naction: int
    nchoice: Numbers
    max_step: int
    nstart: int
    ninfo: int
    info_name: Any
    score_name: bytes | None
    target: float
    key: Any
    nkey: int
    rest: Numbers
    period: float
    move: float
    has_jaw: bool
    meaning: str
    hash: int


class OmRlSetting(Struct):
    """typedef struct OmRlSetting {  // of a task, as written by a user
    const char *key, *value;
} OmRlSetting;"""
    key: bytes | None
    value: bytes | None


class OmRlTaskKind(Struct):
    """typedef struct OmRlTaskKind {
    const char *name, *about;
    OmStatus (*create)(const OmRlSetting* setting, int nsetting, OmRlTask** task);
} OmRlTaskKind;"""
    name: bytes | None
    about: bytes | None
    create: Any


class OmRlVecDef(Struct):
    """typedef struct OmRlVecDef {
    OmCookie cookie;
    const OmRlTask* task;  // borrowed until the vector is destroyed
    int nenv;              // environments, 1 to 65536, default 8
    int nworker;           // 0 (default): one per processor; the same bytes for any
    uint64_t seed;         // default 1
    bool has_info;         // final_info is computed; default true
    // Where an episode ends, the next one begins in the same step; default true. If false, the environment keeps its
    // last state, and must be reset before the next step.
    bool has_autoreset;
} OmRlVecDef;"""
    cookie: int
    task: Any
    nenv: int
    nworker: int
    seed: int
    has_info: bool
    has_autoreset: bool


class OmRlStep(Struct):
    """typedef struct OmRlStep {
    float* obs;            // after the step, or the start of the next episode (nenv x nobservation)
    double* reward;        // (nenv)
    bool* is_terminated;   // the task ended the episode (nenv)
    bool* is_truncated;    // the limit of steps ended the episode (nenv)
    float* final_obs;      // last observation of an episode (nenv x nobservation)
    double* final_info;    // last infos (nenv x ninfo)
    double* final_return;  // sum of the rewards (nenv)
    int* final_length;     // steps (nenv)
} OmRlStep;"""
    obs: Any
    reward: Any
    is_terminated: Any
    is_truncated: Any
    final_obs: Any
    final_info: Any
    final_return: Any
    final_length: Any


class OmRlDemos(Struct):
    """typedef struct OmRlDemos {  // om_rl_demos_done frees
    char task[OM_RL_NAME];  // empty: the file does not say
    char meaning
        [OM_RL_MEANING];  // of the task (rl.h); empty: the file does not say, or there is none
    int nobservation, naction;
    int nchoice[OM_RL_MAX_ACTION];
    int ndemo;
    int nstep;       // of all demonstrations
    int* adr;        // first step of each, and nstep (ndemo + 1)
    float* obs;      // before each step (nstep x nobservation)
    int* action;     // (nstep x naction)
    double* reward;  // (nstep)
    double* score;   // of each demonstration: the task's score, or the return (ndemo)
} OmRlDemos;"""
    task: str
    meaning: str
    nobservation: int
    naction: int
    nchoice: Numbers
    ndemo: int
    nstep: int
    adr: Any
    obs: Any
    action: Any
    reward: Any
    score: Any


class OmRlDriveNow(Struct):
    """typedef struct OmRlDriveNow {  // of the episode in progress
    int episode;               // counts from 0
    int nstep;                 //
    double sum;                // of the rewards
    bool is_over;              // the task ended it, or the limit of steps
    bool is_terminated;        // the task ended it
} OmRlDriveNow;"""
    episode: int
    nstep: int
    sum: float
    is_over: bool
    is_terminated: bool


class OmRlPolicyDef(Struct):
    """typedef struct OmRlPolicyDef {
    OmCookie cookie;
    char task[OM_RL_NAME];          // its name
    int nobservation;               // values of an observation
    int naction;                    // components of an action
    int nchoice[OM_RL_MAX_ACTION];  // choices of each
    int nlayer;                     // hidden layers, 1 to 8, default 2
    int width;                      // of each, 1 to 4096, default 128
    OmActivation activation;        // of each, default OM_TANH; of a picture OM_RELU
    // Sides of the picture that is observed, at least OM_RL_MIN_SIDE: convolutions. 0 (default where the task's
    // observation is no picture, or a smaller one): a perceptron reads the values.
    int picture_width, picture_height;
    uint64_t seed;  // of the weights, default 1
} OmRlPolicyDef;"""
    cookie: int
    task: str
    nobservation: int
    naction: int
    nchoice: Numbers
    nlayer: int
    width: int
    activation: Choice[OmActivation]
    picture_width: int
    picture_height: int
    seed: int


class OmRlEval(Struct):
    """typedef struct OmRlEval {  // om_rl_eval_done frees
    int nepisode;
    double* ret;     // sum of rewards of each episode (nepisode)
    double* score;   // the task's score; the return where the task names none (nepisode)
    int* length;     // steps (nepisode)
    bool* is_ended;  // the task ended the episode, not the limit of steps (nepisode)
    double* info;    // the task's infos at the end of each episode (nepisode x ninfo of the task)
    double mean_return, mean_score, min_score, mean_length;
} OmRlEval;"""
    nepisode: int
    ret: Any
    score: Any
    length: Any
    is_ended: Any
    info: Any
    mean_return: float
    mean_score: float
    min_score: float
    mean_length: float


class OmRlEvalDef(Struct):
    """typedef struct OmRlEvalDef {
    OmCookie cookie;
    const OmRlTask* task;
    OmRlPolicy* policy;  // null: the task's expert, or without one random actions
    int nepisode;   // 0 (default): one from each start of the evaluation, or 100 drawn episodes
    bool is_drawn;  // episodes begin at drawn starts, not at those of the evaluation; default false
    bool is_random;  // actions are drawn from the policy; default false: the most probable action
    bool is_expert;  // the task's expert acts; default false
    int nworker;     // 0 (default): one per processor; the same bytes for any
    uint64_t seed;   // default 1000
} OmRlEvalDef;"""
    cookie: int
    task: Any
    policy: Any
    nepisode: int
    is_drawn: bool
    is_random: bool
    is_expert: bool
    nworker: int
    seed: int


class OmRlKidney(Struct):
    """typedef struct OmRlKidney {  // a bent ellipsoid: ((x - bend y^2) / a)^2 + (y / b)^2 + (z / c)^2 = 1
    OmVec3 center;           // m; its height is that of the middle
    OmVec3 half;             // half-axes a, b, c, m
    double bend;             // of the poles away from the endoscope, 1/m
} OmRlKidney;"""
    center: Numbers
    half: Numbers
    bend: float


class OmRlRetractDef(Struct):
    """typedef struct OmRlRetractDef {  // made by om_rl_retract_default_def; lengths in m
    // ---- tissue
    OmRlTissue tissue;  // default OM_RL_CLUSTERS
    double thickness;   // default 3 mm
    // of clusters: found by `omentum study sheet-calibration`; thesis: 12.7 mm, 9.5 mm, 0.361
    double cluster_spacing;    // default 12.0 mm
    double cluster_radius;     // default 14.9 mm
    double cluster_stiffness;  // default 1
    bool has_self_collision;   // default false
    double young, poisson;     // of elements, Pa; default 20 kPa, the truth of that study, and 0.45
    double density;            // kg/m^3; default 1000
    // ---- scene
    OmRlKidney kidney;
    // File that replaces it: a label volume (.nii, .nii.gz, .nrrd ...) or a closed surface (.stl, .obj, .ply, .off,
    // .vtp), in millimetres and RAS unless the file says otherwise. It is turned by its principal axes and put where
    // `kidney` is; tumour and p_T keep their place with respect to the kidney's box. Borrowed for create; default null.
    const char* kidney_file;
    int kidney_label;  // of a volume; default 3, the left kidney of TotalSegmentator
    // of the true kidney and tumour from where observations believe them; default 0
    OmVec3 kidney_shift;
    double tumour_x, tumour_y;          // q is the point of the kidney above; default -0.020 and 0
    double tumour_radius;               // default 8 mm
    OmVec3 target;                      // p_T
    OmVec3 workspace_lo, workspace_hi;  // the tip stays inside; positions are normalised by it
    OmInstrument instrument;            // default OM_LARGE_NEEDLE_DRIVER
    // file of the dVRK that replaces it (om_psm_load_instrument), borrowed for create; default null
    const char* instrument_file;
    OmCamera endoscope;
    // of render and of the observation, 8 to 1024; default 84 x 84
    int picture_width, picture_height;
    // of the grasping place of reward (b) from the fixed side, on the middle line; default 75 mm
    double goal_along;
    // ---- episodes
    int max_step;            // default 2500
    int hold;                // steps that the tip stays at p_T until an episode ends; default 10
    bool has_fixed_horizon;  // an episode never ends before max_step; default false
    // steps within 2 mm of one place after which an episode ends: the tip stands still; 0 (default): never
    int still;
    int repeat;           // of an action in a step, 1 to 100; default 1
    bool has_gripper;     // the gripper is a fourth action, 0 open and 1 close; default false
    double move;          // of the tip along an axis in a step; default 0.5 mm
    double time_step;     // s of tissue in a step; default 0.02
    double grasp_radius;  // fat within this distance of the tip is held; default 5 mm
    double reach;         // fat within this distance of the tip is grasped; default 2 mm
    double start_height;  // of the tip above the fat at the start; default 12 mm
    OmRlReward reward;    // default OM_RL_REWARD_EXPOSE
    double step_cost;     // of a step in OM_RL_REWARD_EXPOSE; default 0.002
    // width of the kidney around the tumour that OM_RL_REWARD_EXPOSE counts like the tumour; default 0
    double margin;
    int npoint;        // tissue points in the observation, 0 to OM_RL_MAX_POINT; default 0
    bool has_picture;  // the observation is the endoscope's picture, nothing else; default false
    bool is_awake;     // step the tissue also while nothing touches it; default false
    // ---- errors of "reality" and of randomisation
    // mean distance of the true tip from its measured place, drawn in each episode; default 0
    double tip_error;
    double camera_noise;  // standard deviation of a pixel's value, 0 to 255; default 0
    double slip_force;    // N, fat slips out of the jaws beyond it; of elements; default 0: never
    // Bodies, 1 to OM_RL_MAX_VARIANT; each episode draws one. Body k is the same in every task; each takes a second to
    // make. Default 1: the body of this definition.
    int nvariant;
    double vary_thickness;  // thickness of a body is up to this share more or less; default 0
    double vary_softness;   // young and cluster_stiffness are up to this share less; default 0
    double vary_kidney;     // kidney_shift is up to this distance off, in x and y; default 0
    OmCookie cookie;
} OmRlRetractDef;"""
    tissue: Choice[OmRlTissue]
    thickness: float
    cluster_spacing: float
    cluster_radius: float
    cluster_stiffness: float
    has_self_collision: bool
    young: float
    poisson: float
    density: float
    kidney: OmRlKidney
    kidney_file: bytes | None
    kidney_label: int
    kidney_shift: Numbers
    tumour_x: float
    tumour_y: float
    tumour_radius: float
    target: Numbers
    workspace_lo: Numbers
    workspace_hi: Numbers
    instrument: Choice[OmInstrument]
    instrument_file: bytes | None
    endoscope: OmCamera
    picture_width: int
    picture_height: int
    goal_along: float
    max_step: int
    hold: int
    has_fixed_horizon: bool
    still: int
    repeat: int
    has_gripper: bool
    move: float
    time_step: float
    grasp_radius: float
    reach: float
    start_height: float
    reward: Choice[OmRlReward]
    step_cost: float
    margin: float
    npoint: int
    has_picture: bool
    is_awake: bool
    tip_error: float
    camera_noise: float
    slip_force: float
    nvariant: int
    vary_thickness: float
    vary_softness: float
    vary_kidney: float
    cookie: int


class OmRlSurvey(Struct):
    """typedef struct OmRlSurvey {
    double along[OM_RL_GRID];   // of each row from the fixed side, m
    double across[OM_RL_GRID];  // of each column from the middle, m
    // TE after grasping there and moving straight to p_T, rows from the fixed side
    double exposure[OM_RL_GRID][OM_RL_GRID];
} OmRlSurvey;"""
    along: Numbers
    across: Numbers
    exposure: Any


class OmRlTrace(Struct):
    """typedef struct OmRlTrace {  // om_rl_trace_done frees
    char name[256];         // of the file, for messages
    int n;                  // rows
    bool has_jaw;           // the table has the column jaw
    double* time;           // s, grows                                            (n)
    double* tip;            // m, in the frame of the task                         (n x 3)
    double* jaw;            // opening angle, rad; 0 without the column            (n)
    int* line;              // of the file                                         (n)
} OmRlTrace;"""
    name: str
    n: int
    has_jaw: bool
    time: Any
    tip: Any
    jaw: Any
    line: Any


class OmRlFollow(Struct):
    """typedef struct OmRlFollow {  // what came of following a trace
    double deviation;    // m, largest distance between the path of the table and that of the tip
    double score;        // of the episode
    int nstep;           //
    bool is_terminated;  // the task ended the episode
} OmRlFollow;"""
    deviation: float
    score: float
    nstep: int
    is_terminated: bool


class OmRlTrainRow(Struct):
    """typedef struct OmRlTrainRow {  // of metrics.csv, one an iteration
    int64_t step;              // of all environments together
    int64_t nepisode;          // finished so far
    double mean_return;        // of the last 100 episodes; NaN before the first
    double mean_length;        // the same
    double mean_score;         // the same
    double loss_policy, loss_value, entropy;
    double divergence;     // approximate KL of the update
    double clip_fraction;  // samples whose ratio left the clip range
    double rate;           // learning rate
    // GAIL: share of samples that the discriminator judges right, demonstrations and the policy's
    double right_demo, right_policy;
    // of the evaluation after this iteration; NaN: there was none
    double eval_score, eval_return, eval_least;  // mean score, mean return, lowest score
    double seconds;  // of training, without the time between a stop and its resumption
} OmRlTrainRow;"""
    step: int
    nepisode: int
    mean_return: float
    mean_length: float
    mean_score: float
    loss_policy: float
    loss_value: float
    entropy: float
    divergence: float
    clip_fraction: float
    rate: float
    right_demo: float
    right_policy: float
    eval_score: float
    eval_return: float
    eval_least: float
    seconds: float


class OmRlTrainDef(Struct):
    """typedef struct OmRlTrainDef {
    OmCookie cookie;
    const OmRlTask* task;
    const char* out_dir;   // null: no files
    OmRlMethod method;     // default OM_RL_PPO
    int64_t nstep;         // steps of all environments together, default 1,000,000
    int nenv;              // default 16
    int nworker;           // 0 (default): one per processor; the same bytes for any
    uint64_t seed;         // default 1
    OmRlPolicyDef policy;  // its networks
    const char* start;     // file of a policy whose weights are used at the start; default null
    // PPO
    int horizon;        // steps of each environment an iteration, default 64
    int batch;          // samples a descent; divides nenv x horizon; default 256
    int nepoch;         // passes over the samples of an iteration, default 3
    double rate;        // learning rate, falls linearly to 0; default 3e-4
    double gamma;       // discount, default 0.99
    double lambda;      // of GAE, default 0.95
    double clip;        // of the ratio, default 0.2
    double clip_value;  // of the change of the value; 0: none; default 0.2
    double entropy;     // weight of the entropy, default 5e-3
    // The actor's logits are multiplied by it over the third quarter of the training, 0.01 to 100. Above 1 drawn
    // actions become the most probable ones, which a user takes; default 1
    double sharpness;
    double value;              // weight of the value's loss, default 0.5
    double max_norm;           // of the gradient of both networks; 0: any; default 0.5
    bool normalise_advantage;  // in each batch; default true
    bool normalise_reward;     // by the standard deviation of discounted returns; default true
    // Demonstrations: GAIL and cloning
    const char* demos;     // file of om_rl_demos_save
    double weight_reward;  // of the task's reward beside GAIL's, default 0.2
    double weight_gail;    // default 0.8
    int clone_epoch;       // epochs of cloning: before GAIL (default 0), or alone (0: 200)
    double clone_rate;     // learning rate of cloning; default 0: `rate`
    double gail_rate;      // learning rate of the discriminator, default 3e-4
    double gail_noise;     // standard deviation added to its observations, default 0.02
    int gail_epoch;        // passes over the samples of an iteration, default 1
    bool gail_actions;     // it sees actions beside observations; default false
    // Evaluations during PPO and GAIL: episodes of the most probable actions. The policy with the highest mean score
    // is kept (then the highest mean return, then the later one) and is the result.
    int eval_period;     // iterations; the last one is always evaluated; 0 (default): none
    int eval_nepisode;   // of an evaluation, from drawn starts, always the same; default 32
    uint64_t eval_seed;  // of these episodes; default 2000
    // evaluations in a row in which every episode reaches the task's target: the training ends; 0 (default): never
    int eval_stop;
    const OmRlTask* eval_task;  // with the same observations and actions; null (default): `task`
    //
    double checkpoint_period;                            // s, default 30; 0: after each iteration
    const char* command;                                 // for the metadata; default null
    void (*on_row)(void* ctx, const OmRlTrainRow* row);  // after each iteration; may be null
    void* ctx;
} OmRlTrainDef;"""
    cookie: int
    task: Any
    out_dir: bytes | None
    method: Choice[OmRlMethod]
    nstep: int
    nenv: int
    nworker: int
    seed: int
    policy: OmRlPolicyDef
    start: bytes | None
    horizon: int
    batch: int
    nepoch: int
    rate: float
    gamma: float
    lambda_: float
    clip: float
    clip_value: float
    entropy: float
    sharpness: float
    value: float
    max_norm: float
    normalise_advantage: bool
    normalise_reward: bool
    demos: bytes | None
    weight_reward: float
    weight_gail: float
    clone_epoch: int
    clone_rate: float
    gail_rate: float
    gail_noise: float
    gail_epoch: int
    gail_actions: bool
    eval_period: int
    eval_nepisode: int
    eval_seed: int
    eval_stop: int
    eval_task: Any
    checkpoint_period: float
    command: bytes | None
    on_row: Any
    ctx: Any


class OmRlTrainResult(Struct):
    """typedef struct OmRlTrainResult {  // om_rl_train_result_done frees
    OmRlPolicy* policy;
    OmRlTrainRow* row;  // (nrow)
    int nrow;
    bool is_resumed;
    int64_t kept_step;  // steps before the kept policy; 0: the last one, there were no evaluations
    double seconds;
} OmRlTrainResult;"""
    policy: Any
    row: Any
    nrow: int
    is_resumed: bool
    kept_step: int
    seconds: float


class OmCtDef(Struct):
    """typedef struct OmCtDef {
    OmCookie cookie;
    uint64_t seed;         // of noise and of the shape of the fat's surface
    double voxel;          // side of a voxel, m; default 1.5 mm
    double organ_half;     // half the organ's extent to the right and up the body, m; default 70 mm
    double fat_half;       // half the fat's, m; default 48 mm
    double fat_thickness;  // m, mean; default 7 mm
    double fat_ripple;     // m, amplitude of the thickness; default 0.7 mm
    // m, of the tumour's centre from the organ's middle: to the right, up the body; default 8 and -6 mm
    double tumour_shift[2];
    double tumour_radius;  // m; default 9 mm
    double tumour_height;  // m, by which it rises out of the organ; default 4 mm
    double blur;           // standard deviation of the scanner's blur, voxels; default 0.8
    double noise;          // standard deviation, HU; default 20
} OmCtDef;"""
    cookie: int
    seed: int
    voxel: float
    organ_half: float
    fat_half: float
    fat_thickness: float
    fat_ripple: float
    tumour_shift: Numbers
    tumour_radius: float
    tumour_height: float
    blur: float
    noise: float


class OmStuffDef(Struct):
    """typedef struct OmStuffDef {
    OmCookie cookie;
    double edge;    // mean length of an inner edge, m, > 0; no default
    OmShapeFn fn;   // negative inside; called from several threads
    void* ctx;      // borrowed
    OmVec3 lo, hi;  // the box that holds the solid, m
    double level;   // the surface is fn = level; default 0
    int max_tet;    // larger meshes are refused; default 20 million
    int nworker;    // 0: one a processor (the mesh does not depend on it); default 0
} OmStuffDef;"""
    cookie: int
    edge: float
    fn: Any
    ctx: Any
    lo: Numbers
    hi: Numbers
    level: float
    max_tet: int
    nworker: int


class OmMeshQuality(Struct):
    """typedef struct OmMeshQuality {
    int nvert, ntet, nboundary_tri;
    double volume;                          // m^3
    double dihedral_min, dihedral_max;      // rad
    int64_t dihedral_bin[OM_DIHEDRAL_BIN];  // angles in [10 i, 10 (i + 1)) degrees
    double edge_min, edge_mean, edge_max;   // over distinct edges, m
    int npart;                              // parts connected over faces
    int euler;                              // Euler characteristic of the boundary
    int nlayer;  // elements through the thickest part: twice the edges to its middle, at least 1
    bool is_manifold;  // every boundary edge belongs to two boundary triangles
} OmMeshQuality;"""
    nvert: int
    ntet: int
    nboundary_tri: int
    volume: float
    dihedral_min: float
    dihedral_max: float
    dihedral_bin: Numbers
    edge_min: float
    edge_mean: float
    edge_max: float
    npart: int
    euler: int
    nlayer: int
    is_manifold: bool


class OmPatchDef(Struct):
    """typedef struct OmPatchDef {
    OmCookie cookie;
    double share;   // of the candidates that the patch takes, 0-1; no default
    uint64_t seed;  // no default
    int center;     // the point P, a surface vertex; -1 (default) draws one of the candidates
    double w_d[2];  // range of the weight of the geodesic distance over its largest value; 0.3-0.7
    double w_n[2];  // ... of the angle between the normals over pi; 1.0-1.5
    double w_p[2];  // ... of the noise, which runs over 0-1; 0.1-0.4
    // Wavelength of the noise, m; 0 (default): a quarter of the largest distance.
    double noise_length;
} OmPatchDef;"""
    cookie: int
    share: float
    seed: int
    center: int
    w_d: Numbers
    w_n: Numbers
    w_p: Numbers
    noise_length: float


class OmPatientMaterial(Struct):
    """typedef struct OmPatientMaterial {
    char name[OM_NAME_LEN];
    int label;       // elements whose tet_label is this; -1: every element no other material names
    double young;    // Pa
    double poisson;  // 0 to 0.4999
    double density;  // kg/m^3
} OmPatientMaterial;"""
    name: str
    label: int
    young: float
    poisson: float
    density: float


class OmPatient(Struct):
    """typedef struct OmPatient {  // om_patient_done frees
    char name[OM_NAME_LEN];
    // The deformable tissue, with the set "attachment"; a sheet also has "underside", "top",
    // "border".
    OmTetMesh mesh;
    OmPatientMaterial material[OM_MAX_MATERIAL];
    int nmaterial;
    OmSurface organ;       // what the tissue rests on, closed, rigid; nvert is 0 if there is none
    double organ_spacing;  // grid step for the organ's distance field, m
    double* roi_point;     // points of the region of interest, m            (nroi x 3)
    double* roi_normal;    // outward normals there                          (nroi x 3)
    int nroi;
    OmVec3 roi_center;   // centre of the region, m
    double roi_radius;   // m
    OmVec3 up;           // unit direction away from the covered side; an endoscope looks against it
    OmSpace file_space;  // of tissue.vtu and organ.ply when saved; default OM_SPACE_NONE: RAS
} OmPatient;"""
    name: str
    mesh: OmTetMesh
    material: Any
    nmaterial: int
    organ: OmSurface
    organ_spacing: float
    roi_point: Any
    roi_normal: Any
    nroi: int
    roi_center: Numbers
    roi_radius: float
    up: Numbers
    file_space: Choice[OmSpace]


class OmAttachDef(Struct):
    """typedef struct OmAttachDef {
    char face[16];       // "border", "underside", "top"
    char direction[64];  // om_model_direction's words, "random", or "" for the whole face
    double share;        // part of the face's vertices, 0-1
    uint64_t seed;       // of "random"
    double turn;  // rad, by which the direction is turned about the covered side's; default 0
} OmAttachDef;"""
    face: str
    direction: str
    share: float
    seed: int
    turn: float


class OmSheetDef(Struct):
    """typedef struct OmSheetDef {
    double thickness;  // m; default 0: no sheet, the organ itself is the tissue
    double bridge;     // hollows of the organ narrower than twice this are bridged, m; default 0.02
    double gap;        // between organ and sheet, m; default 0
    char side[64];     // the covered side, om_model_direction's words; default "anterior"
    // Half of the extent along the organ's longest axis, m; 0 (default): 0.8 of the organ's.
    double half_length;
    double half_width;  // half-extent across it, m; default 0: 0.8 of the organ's
    double corner;  // radius of the outline's corners, m; default 0: half the smaller half-extent
    double wrap;    // m, extent of the sheet below the organ's centre, around its sides; default 0
    OmAttachDef attach[OM_MAX_ATTACH];  // default (nattach 0): "border:medial 25 %"
    int nattach;
    double tumour_radius;    // of the ROI on the organ's surface, m; default 0.012
    double tumour_height;    // how far it bulges out of the organ, m; default 0.003
    double tumour_shift[2];  // of its centre from the middle of the sheet: along, across, m
    int nroi;                // points sampled on it; default 200
} OmSheetDef;"""
    thickness: float
    bridge: float
    gap: float
    side: str
    half_length: float
    half_width: float
    corner: float
    wrap: float
    attach: Any
    nattach: int
    tumour_radius: float
    tumour_height: float
    tumour_shift: Numbers
    nroi: int


class OmOverDef(Struct):
    """typedef struct OmOverDef {
    int label
        [OM_MAX_LABEL];  // of the organ, the ROI's among them; default (nlabel 0): nothing is below
    int nlabel;
    int roi;        // label on the organ's surface that is to be exposed; default -1: no ROI
    char side[64];  // on which the tissue lies, om_model_direction's words; default "anterior"
    // m: vertices of the tissue this close to the organ meet it, and the organ's surface this close to the label of the
    // ROI belongs to the ROI; default 0: a voxel and a half
    double reach;
    OmAttachDef attach[OM_MAX_ATTACH];  // default (nattach 0): "underside:random 30 %", seed 1
    int nattach;
    int nroi;  // points sampled on the ROI; default 200
} OmOverDef;"""
    label: Numbers
    nlabel: int
    roi: int
    side: str
    reach: float
    attach: Any
    nattach: int
    nroi: int


class OmModelDef(Struct):
    """typedef struct OmModelDef {
    OmCookie cookie;
    char input[1024];  // volume (NIfTI, NRRD), volume mesh (.msh .vtk .vtu), surface (STL OBJ PLY)
    char name[OM_NAME_LEN];  // of the model; default: the input's file name
    int volume;  // of a file of several volumes, from 0; default -1: such a file is refused
    // What is meshed is the union of labels by number and by name. Default: the one label above 0; a file
    // of several labels is refused.
    int label[OM_MAX_LABEL];
    int nlabel;
    char label_name[OM_MAX_LABEL][OM_SEGMENT_NAME];  // as the file names them; case does not count
    int nlabel_name;
    bool all_labels;  // every value above 0
    // bytes that the voxels of a volume may take; default OM_VOLUME_MAX_SIZE
    uint64_t max_volume_size;
    bool has_window;  // intensities in [window_lo, window_hi] instead of labels
    double window_lo, window_hi;
    int part[OM_MAX_PART];  // the connected parts kept, 1 being the largest; npart 0: see keep_all
    int npart;
    bool keep_all;        // all parts of at least min_share; default false: the largest
    double min_share;     // smallest part kept, share of the voxels; default 0.01
    int connectivity;     // of voxels, 6 or 26; default 6
    bool keep_holes;      // default false: holes are filled
    double close_radius;  // m; default 0: no closing
    double smooth;        // voxels; default 1.2
    double edge;          // mean edge of the mesh, m
    double unit;          // m per unit of the file; default 0: as the file says, else a millimetre
    OmSpace space;        // of a mesh or surface file; default OM_SPACE_NONE: as it says, else RAS
    bool remesh;  // remesh a volume mesh from its distance field; default false: use its elements
    bool refine;  // halve the error by finer edges where the volume error passes 2 %; default true
    OmPatientMaterial material[OM_MAX_MATERIAL];  // default: fat for a sheet, else soft tissue
    int nmaterial;
    OmSheetDef sheet;
    OmOverDef over;  // not together with a sheet
    int nworker;     // default 0: one a processor
} OmModelDef;"""
    cookie: int
    input: str
    name: str
    volume: int
    label: Numbers
    nlabel: int
    label_name: Any
    nlabel_name: int
    all_labels: bool
    max_volume_size: int
    has_window: bool
    window_lo: float
    window_hi: float
    part: Numbers
    npart: int
    keep_all: bool
    min_share: float
    connectivity: int
    keep_holes: bool
    close_radius: float
    smooth: float
    edge: float
    unit: float
    space: Choice[OmSpace]
    remesh: bool
    refine: bool
    material: Any
    nmaterial: int
    sheet: OmSheetDef
    over: OmOverDef
    nworker: int


class OmModelReport(Struct):
    """typedef struct OmModelReport {
    OmMeshQuality quality;
    char selected[256];   // the labels that were meshed, in words; "" if the input is no volume
    int64_t nvoxel;       // with these labels
    OmVec3 voxel;         // sides of a voxel, m
    double label_volume;  // of the voxels with these labels, m^3; 0 if the input is no volume
    double label_error;   // volume of the organ's mesh (under a sheet: surface) / label_volume - 1
    double part_volume[OM_MAX_PART];  // of the largest parts found, m^3
    bool part_is_kept[OM_MAX_PART];   //
    double left_out;                  // m^3, of all parts that were not kept
    double filled;                    // m^3, of holes that were filled
    double mask_volume;               // of the cleaned mask, m^3; 0 if the input is no volume
    double mesh_volume;               // of the organ's tetrahedral mesh, m^3
    double surface_volume;            // of the organ's marching-cubes surface, m^3
    double volume_error;              // |mesh - mask| / mask
    // distance of the mesh's boundary to the level set, m
    double surface_error_mean, surface_error_max;
    // Mean distance of the level set to the faces of the voxels, in voxels.
    double surface_error_voxel;
    double level_shift;  // of the level set that makes the volume right, m
    double edge;         // mean edge asked of the mesher in the end, m
    int npart_mask, npart_kept;
    int ncapped;        // inside voxels on the border of the volume: the organ was cut there
    double seconds;     // wall clock of the whole build
    char note[1024];    // what was assumed, left out, converted: empty, or a sentence a line
    char warning[512];  // empty, or sentences
} OmModelReport;"""
    quality: OmMeshQuality
    selected: str
    nvoxel: int
    voxel: Numbers
    label_volume: float
    label_error: float
    part_volume: Numbers
    part_is_kept: Numbers
    left_out: float
    filled: float
    mask_volume: float
    mesh_volume: float
    surface_volume: float
    volume_error: float
    surface_error_mean: float
    surface_error_max: float
    surface_error_voxel: float
    level_shift: float
    edge: float
    npart_mask: int
    npart_kept: int
    ncapped: int
    seconds: float
    note: str
    warning: str


class OmLabelRow(Struct):
    """typedef struct OmLabelRow {
    char name[OM_SEGMENT_NAME];  // "" if the file gives none
    int label;         // what OmModelDef.label takes; -1: only its volume and value choose it
    int value, layer;  // of its voxels, and the volume of the file they are in
    int64_t nvoxel;    //
    double volume;     // m^3
    int npart;         // connected over faces
    double largest;    // volume of the largest part, m^3
    bool is_cut;       // a voxel lies on the border of the volume
    OmVec3 lo, hi;     // box around its voxels, RAS m
    OmVec3 centroid;   // RAS m
} OmLabelRow;"""
    name: str
    label: int
    value: int
    layer: int
    nvoxel: int
    volume: float
    npart: int
    largest: float
    is_cut: bool
    lo: Numbers
    hi: Numbers
    centroid: Numbers


class OmLabelList(Struct):
    """typedef struct OmLabelList {  // om_label_list_done frees
    int dim[3];
    OmVec3 voxel;       // sides of a voxel, m
    int nentry;         // volumes of the file
    bool has_layers;    // they are layers of segments, and all were read
    bool is_intensity;  // the values are no labels: they have fractions, are negative or too many
    double min, max;    // of the values
    int nempty;         // segments of a table of names that have no voxel; no row
    int nrow;
    OmLabelRow* row;  // in the order of layer and value                 (nrow)
} OmLabelList;"""
    dim: Numbers
    voxel: Numbers
    nentry: int
    has_layers: bool
    is_intensity: bool
    min: float
    max: float
    nempty: int
    nrow: int
    row: Any


class OmYamlField(Struct):
    """typedef struct OmYamlField {
    const char* key;
    OmYamlKind kind;
    size_t offset;    // of the member in the struct that is filled
    double min, max;  // inclusive range in the file's unit; both 0: any finite number
    double scale;     // file unit to SI; 0 means 1
    size_t size;      // bytes of a string, or of one list item
    const struct OmYamlSchema* sub;  // of a struct or of list items
    const char* const* name;         // of an enum, ended by null
    size_t count_offset;             // of the int that receives a list's length
    int capacity;                    // most items of a list; count of numbers
    // of a text: line ends and tabs may stand in it; other control characters never
    bool has_lines;
    bool is_required;
    // bits for the schema's owner, who prints the keys of a group; 0: of all groups
    unsigned group;
    const char* unit;  // of the number in the file; null: none
    const char* help;  // its meaning in one line, for people; null: none
} OmYamlField;"""
    key: bytes | None
    kind: Choice[OmYamlKind]
    offset: int
    min: float
    max: float
    scale: float
    size: int
    sub: Any
    name: Any
    count_offset: int
    capacity: int
    has_lines: bool
    is_required: bool
    group: int
    unit: bytes | None
    help: bytes | None


class OmYamlSchema(Struct):
    """typedef struct OmYamlSchema {
    const char* title;  // for messages: "scene", "material"
    const OmYamlField* field;
    int nfield;
    /// Called on each list item before it is read, to set defaults; may be null.
    void (*set_default)(void* item);
    /// Former names of keys: former, present, ..., ended by null; may be null. A former name is an error that tells the
    /// present one.
    const char* const* renamed;
    size_t line_offset;  // of an int that receives the line of the mapping; 0: none
} OmYamlSchema;"""
    title: bytes | None
    field: Any
    nfield: int
    set_default: Any
    renamed: Any
    line_offset: int


class OmYamlPrint(Struct):
    """typedef struct OmYamlPrint {
    unsigned group;     // fields whose group has none of these bits are left out; 0: none is
    bool is_commented;  // unit, range and meaning behind each value
    bool shows_others;  // fields left out are printed as comments
} OmYamlPrint;"""
    group: int
    is_commented: bool
    shows_others: bool


class OmStereoPair(Struct):
    """typedef struct OmStereoPair {  // borrowed
    // Intrinsics and poses. The right camera stands on the right of the left one: the baseline is within 30 degrees of
    // the left camera's x axis, and both axes of view are within 60 degrees of its normal.
    OmCamera left, right;
    const OmPicture *left_picture, *right_picture;  // of the cameras' sizes, 1, 3 or 4 channels
} OmStereoPair;"""
    left: OmCamera
    right: OmCamera
    left_picture: Any
    right_picture: Any


class OmStereoDef(Struct):
    """typedef struct OmStereoDef {
    OmCookie cookie;       // set by om_stereo_default_def
    double near_m, far_m;  // range of depth that is searched, m; default 40 mm to 400 mm
    int penalty_one;       // P1: disparities of neighbours differ by one; default 8, 1 to 60
    int penalty_jump;      // P2 > P1: they differ by more; default 96, to 120
    // The best sum of costs is below the next best, not its neighbour, by this share; default 0.02, 0 to 1.
    double min_gain;
    double max_twist;  // pixels, between the disparities of left and right; default 1
    int min_patch;     // pixels: smaller islands of disparity are noise; default 100
    bool is_refined;   // improve the disparities below a pixel on the grey values; default true
    int nworker;       // 0: one a processor; the depth does not depend on it
} OmStereoDef;"""
    cookie: int
    near_m: float
    far_m: float
    penalty_one: int
    penalty_jump: int
    min_gain: float
    max_twist: float
    min_patch: int
    is_refined: bool
    nworker: int


class OmStereoReport(Struct):
    """typedef struct OmStereoReport {
    double share;     // pixels with depth, 0 to 1
    int ndisparity;   // candidates of a pixel
    double baseline;  // m
    double focal;     // pixels, of the rectified pictures: depth is focal x baseline / disparity
    double ms_rectify, ms_match, ms_refine, ms_total;
} OmStereoReport;"""
    share: float
    ndisparity: int
    baseline: float
    focal: float
    ms_rectify: float
    ms_match: float
    ms_refine: float
    ms_total: float


class OmSurfacePoint(Struct):
    """typedef struct OmSurfacePoint {  // a point on a surface
    int tri;                     // its triangle
    double bary[3];              // weights of the triangle's vertices
    OmVec3 x;                    // m
    double distance;             // from the point of the query, m
} OmSurfacePoint;"""
    tri: int
    bary: Numbers
    x: Numbers
    distance: float


class OmUmeshGrid(Struct):
    """typedef struct OmUmeshGrid {    // om_umesh_grid_done frees
    OmFemGrid fem;              // points, nodes, elements, fixed nodes
    OmVec3 up;                  // unit, towards the side from which the probe comes
    unsigned char* is_surface;  // nodes of the free boundary             (fem.mesh.nnode)
    double* surface_x;          // their nearest points on the organ, m   (fem.mesh.nnode x 3)
    uint64_t hash;              // of all fields
} OmUmeshGrid;"""
    fem: OmFemGrid
    up: Numbers
    is_surface: Any
    surface_x: Any
    hash: int


class OmUmeshPatch(Struct):
    """typedef struct OmUmeshPatch {
    OmVec3 center;  // on the organ's surface, m
    OmVec3 normal;  // outward there, unit
    OmVec3 along;   // of the long side, unit, across the normal
    // Long side and short side, m; and the largest distance of a point from the plane of the face, on either side, m.
    double size[3];
} OmUmeshPatch;"""
    center: Numbers
    normal: Numbers
    along: Numbers
    size: Numbers


class OmUmeshOrganDef(Struct):
    """typedef struct OmUmeshOrganDef {  // made by om_umesh_organ_default_def
    // A patient of one material, borrowed until create returns; null (default): the phantom, a half
    // ellipsoid of 150 x 120 x 72 mm on its flat side.
    const OmPatient* patient;
    const OmSurface* surface;  // or a closed surface; borrowed; default null
    OmVec3 up;                 // away from the fixed side; default 0: the patient's, else +z
    int nelem;       // number of active elements, within 1 % if >= 200; default 2174 (thesis)
    double spacing;  // of the grid, m; default 0: computed from nelem
    int dim[3];      // smallest number of points of the padded grid; default 0: no lower bound
    int multiple;  // dim are multiples of this, the longest of twice this; default 4: U-Net of 3 levels
    // An element is active if this part of its volume is inside the organ, in (0, 1); default 0.5.
    double min_fill;
    // Nodes in this lowest part of the height are fixed; 0 (default): the patient's set
    // "attachment", without one the lowest nodes (phantom) or the lowest tenth (other organs).
    double held_height;
    OmCookie cookie;
} OmUmeshOrganDef;"""
    patient: Any
    surface: Any
    up: Numbers
    nelem: int
    spacing: float
    dim: Numbers
    multiple: int
    min_fill: float
    held_height: float
    cookie: int


class OmUmeshDataDef(Struct):
    """typedef struct OmUmeshDataDef {  // made by om_umesh_data_default_def
    const OmUmeshOrgan* organ;   // borrowed
    const char* out_dir;         // borrowed
    int nsample;                 // default 1000
    uint64_t seed;               // default 1
    // Default: neo-Hookean with the patient's modulus and Poisson's ratio; without a patient 1800
    // Pa and 0.45.
    OmMaterial material;
    double max_force;    // N, default 0.8
    double max_tilt;     // rad, default 45 degrees
    double press_share;  // fraction of samples with a prescribed displacement; default 0.5
    // m, default 0.035; never more than 0.6 of the distance to the nearest fixed node.
    double max_press;
    double pull_share;     // fraction of samples that are pulled outwards; default 0
    double patch_size[3];  // OmUmeshPatch.size, m; default 0.05, 0.01, 0.01
    int min_patch;         // a patch with fewer nodes is drawn again; default 4
    double tolerance;      // of the residual, relative to loads and reactions; default 1e-5
    double min_volume;     // smallest det F allowed in a sample; default 0.05
    int max_attempt;       // largest number of draws for one sample; default 64
    int shard;             // samples in one file; default 100
    int npicture;          // pictures in the report; default 4
    int nworker;           // default 0: one a processor
    OmCookie cookie;
} OmUmeshDataDef;"""
    organ: Any
    out_dir: bytes | None
    nsample: int
    seed: int
    material: OmMaterial
    max_force: float
    max_tilt: float
    press_share: float
    max_press: float
    pull_share: float
    patch_size: Numbers
    min_patch: int
    tolerance: float
    min_volume: float
    max_attempt: int
    shard: int
    npicture: int
    nworker: int
    cookie: int


class OmUmeshSample(Struct):
    """typedef struct OmUmeshSample {  // how a sample was drawn and solved
    OmUmeshPatch patch;
    OmVec3 force;       // resultant on the patch, N
    OmVec3 direction;   // unit, of the force or the displacement
    double tilt;        // angle between `direction` and the normal, rad
    double press;       // displacement of the probe, m; 0: a force was applied
    int npatch;         // nodes of the patch
    int nattempt;       // draws, failed ones included
    int nfail;          // draws whose solve found no valid equilibrium
    int nnewton;        // Newton iterations of the last draw
    double residual;    // relative
    double min_volume;  // smallest det F
    double max_u;       // largest displacement of a node, m
    double seconds;     // wall clock; not stored
} OmUmeshSample;"""
    patch: OmUmeshPatch
    force: Numbers
    direction: Numbers
    tilt: float
    press: float
    npatch: int
    nattempt: int
    nfail: int
    nnewton: int
    residual: float
    min_volume: float
    max_u: float
    seconds: float


class OmUmeshSummary(Struct):
    """typedef struct OmUmeshSummary {
    int nsample, nmade;    // samples in the folder; samples made by this call
    int nattempt, nfail;   // draws and failed solves of all samples
    double max_u, mean_u;  // m: largest displacement of a node; mean over samples of their largest
    double max_force;      // largest resultant, N
    double seconds;        // of this call
    double solve_seconds;  // mean of the samples made by this call, of one worker
} OmUmeshSummary;"""
    nsample: int
    nmade: int
    nattempt: int
    nfail: int
    max_u: float
    mean_u: float
    max_force: float
    seconds: float
    solve_seconds: float


class OmUmeshData(Struct):
    """typedef struct OmUmeshData {  // a data set in memory; om_umesh_data_done frees
    OmUmeshGrid grid;
    int nsample;
    uint64_t seed;
    uint64_t hash;          // of the grid, the settings and the seed
    OmUmeshSample* sample;  //                                                        (nsample)
    unsigned char* mask;    // nodes of the patch                          (nsample x mesh.nnode)
    float* u;               // displacements, m                        (nsample x mesh.nnode x 3)
} OmUmeshData;"""
    grid: OmUmeshGrid
    nsample: int
    seed: int
    hash: int
    sample: Any
    mask: Any
    u: Any


class OmUmeshTrust(Struct):
    """typedef struct OmUmeshTrust {
    double score;  // the input is inside if this is at most 1
    // Displacement of a node, relative to the largest in training at this place and its neighbours;
    // huge where no sample moved any of them.
    double way;
    double stretch;  // deviation of the displacements from their mean
    double rough;    // difference between neighbouring nodes, relative to the largest displacement
    double size;     // number of nodes, relative to the largest or smallest number in training
    double angle;    // angle between the mean displacement and the inward normal
    bool is_inside;
    char why[128];  // the measure that is outside, as a sentence; "" if none is
} OmUmeshTrust;"""
    score: float
    way: float
    stretch: float
    rough: float
    size: float
    angle: float
    is_inside: bool
    why: str


class OmUmeshTrainDef(Struct):
    """typedef struct OmUmeshTrainDef {  // made by om_umesh_train_default_def
    const OmUmeshData* data;      // borrowed
    const char* out_dir;  // checkpoint, metrics.csv, weights.safetensors, report.html; borrowed
    const char* command;  // command line, stored in the file; may be null
    int nvalid;           // number of validation samples, the last ones; default a tenth
    int base_channels;    // default 16
    int nlevel;           // default 3
    OmNetType type;       // default OM_F32; OM_BF16 is faster where the processor has it
    int batch, nepoch;    // default 4 and 100
    // Poisson's ratio of the linear solution that the network corrects; default 0.45
    double poisson;
    double rate;    // peak of the one-cycle schedule; default 1e-3
    uint64_t seed;  // default 1
    int nworker;    // default 0: one a processor
    OmCookie cookie;
} OmUmeshTrainDef;"""
    data: Any
    out_dir: bytes | None
    command: bytes | None
    nvalid: int
    base_channels: int
    nlevel: int
    type: Choice[OmNetType]
    batch: int
    nepoch: int
    poisson: float
    rate: float
    seed: int
    nworker: int
    cookie: int


class OmUmeshTrainSummary(Struct):
    """typedef struct OmUmeshTrainSummary {
    double valid_error;   // mean norm error of the best epoch on the validation samples, m
    double linear_error;  // the same of the linear solution alone
    int best_epoch, nepoch;
    int64_t nstep;
    double seconds;  // of all calls
    bool is_resumed;
} OmUmeshTrainSummary;"""
    valid_error: float
    linear_error: float
    best_epoch: int
    nepoch: int
    nstep: int
    seconds: float
    is_resumed: bool


class OmUmeshEval(Struct):
    """typedef struct OmUmeshEval {
    int n;
    double mean, sd, worst;
    int worst_sample;                    // counted from `first`
    double network_mean, network_worst;  // the network alone, not relaxed
    double alone_mean, alone_worst;      // the linear solution, not relaxed
    double linear_mean, linear_worst;    // the linear solution, relaxed
    double linear_ms;                    // median time of a relaxed linear solution
    double mean_cycle;                   // mean number of relaxation cycles
    int max_cycle;                       // largest number of relaxation cycles
    int ninverted;                       // relaxed predictions with an inverted element
    int nbeyond;   // relaxed predictions whose error exceeds both the tolerance and the estimate
    double max_u;  // largest displacement of a node in the data
    double ms_median, ms_min, ms_max;  // time of a prediction: median, smallest, largest
    int ninside;                       // samples that the test accepts
    double* error;                     // of each sample (n); freed by om_umesh_eval_done
    double* score;                     // of the test, for each sample (n)
} OmUmeshEval;"""
    n: int
    mean: float
    sd: float
    worst: float
    worst_sample: int
    network_mean: float
    network_worst: float
    alone_mean: float
    alone_worst: float
    linear_mean: float
    linear_worst: float
    linear_ms: float
    mean_cycle: float
    max_cycle: int
    ninverted: int
    nbeyond: int
    max_u: float
    ms_median: float
    ms_min: float
    ms_max: float
    ninside: int
    error: Any
    score: Any


class OmWorldLogInfo(Struct):
    """typedef struct OmWorldLogInfo {
    int narm;
    unsigned sources;  // OM_OBSERVE_ flags
    int64_t size;      // bytes of the file
    int nadvance;      // ticks
    int nobserve;      // observations
    int npicture;      // depth and colour pictures in them
    double time;       // s that all ticks take together
    bool is_complete;  // false: cut off, by a kill or a full disk
} OmWorldLogInfo;"""
    narm: int
    sources: int
    size: int
    nadvance: int
    nobserve: int
    npicture: int
    time: float
    is_complete: bool


class OmSeriesFrame(Struct):
    """typedef struct OmSeriesFrame {
    double time;                 // s, of the exposure; grows from frame to frame
    OmPose pose_world_camera;    // of the camera, or of the left one
    char color[OM_SERIES_FILE];  // PNG, or "": none
    char depth[OM_SERIES_FILE];  // 16-bit grey PNG in units of depth_unit, 0: no return; "": none
    char right[OM_SERIES_FILE];  // PNG of the right camera; "": none
    int narm;                    //
    OmArmObservation arm[OM_MAX_ARM];  // tip, q, jaw and times; other fields are 0
} OmSeriesFrame;"""
    time: float
    pose_world_camera: OmPose
    color: str
    depth: str
    right: str
    narm: int
    arm: Any


class OmSeries(Struct):
    """typedef struct OmSeries {     // om_series_done frees
    char dir[OM_SCENE_PATH];  // the folder
    OmCamera camera;          // intrinsics of all frames; the pose is that of a frame
    bool has_right;           // the right camera of a stereo endoscope
    OmCamera right;           // its pose is in the frame of the left camera
    double depth_unit;        // m a count of a depth picture; default 0.1 mm
    int nframe;               //
    int capacity;             // of frame, while a series is recorded; 0: it was read
    OmSeriesFrame* frame;     // (nframe)
} OmSeries;"""
    dir: str
    camera: OmCamera
    has_right: bool
    right: OmCamera
    depth_unit: float
    nframe: int
    capacity: int
    frame: Any


# ---- types of functions

OmRangeFn = CFUNCTYPE(None, c_void_p, c_int, c_int, c_int)
OmTeamFn = CFUNCTYPE(None, c_void_p, c_void_p, c_int, c_int)
OmLogSink = CFUNCTYPE(None, c_void_p, c_int, c_char_p)
OmShapeFn = CFUNCTYPE(c_double, c_void_p, OmVec3)
OmTrainFillFn = CFUNCTYPE(c_int, c_void_p, POINTER(OmTrainBatch))
OmBanetEstimateFn = CFUNCTYPE(c_int, c_void_p, POINTER(OmSurface), c_void_p, c_void_p, c_void_p)
OmJobFn = CFUNCTYPE(c_int, c_void_p, POINTER(OmProgress))
OmDistanceFn = CFUNCTYPE(c_double, c_void_p, OmVec3, POINTER(OmVec3))
OmTissueStepFn = CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_void_p, c_double, POINTER(OmTissueReport))
OmCalibrationFn = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_void_p)
OmCalibrationFinerFn = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_void_p, c_void_p)
OmCalibrationBuildFn = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, POINTER(c_void_p))
OmEstimateFn = CFUNCTYPE(c_int, c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmProgress), POINTER(OmMatchEstimate))

# ---- fields

complete(OmAllocator, [("alloc", CFUNCTYPE(c_void_p, c_void_p, c_size_t, c_size_t)), ("free", CFUNCTYPE(None, c_void_p, c_void_p)), ("ctx", c_void_p)], {})
complete(OmArena, [("base", c_void_p), ("size", c_size_t), ("used", c_size_t), ("peak", c_size_t)], {})
complete(OmRng, [("key", c_uint32 * 2), ("counter", c_uint32 * 4), ("out", c_uint32 * 4), ("used", c_int)], {})
complete(OmProgress, [("report", CFUNCTYPE(c_bool, c_void_p, c_char_p, c_double, c_double)), ("ctx", c_void_p)], {})
complete(OmProgressBar, [("out", c_void_p), ("is_terminal", c_bool), ("start_time", c_double), ("last_time", c_double), ("last_done", c_double), ("stage", c_char * 64), ("last_width", c_int)], {})
complete(OmText, [("str", c_char_p), ("len", c_size_t), ("cap", c_size_t)], {})
complete(OmJson, [("text", POINTER(OmText)), ("status", c_int), ("depth", c_int), ("is_first", c_bool * 32)], {"status": OmStatus})
complete(OmAtomicFile, [("path", c_char * 1024), ("temp", c_char * 1100), ("stream", c_void_p), ("lock", c_int)], {})
complete(OmFolder, [("place", c_char * 1024), ("path", c_char * 1100), ("kind", c_char * 48), ("lock", c_int), ("is_growing", c_bool), ("has_list", c_bool)], {})
complete(OmVec3, [("x", c_double), ("y", c_double), ("z", c_double)], {})
complete(OmMat3, [("cx", OmVec3), ("cy", OmVec3), ("cz", OmVec3)], {})
complete(OmQuat, [("x", c_double), ("y", c_double), ("z", c_double), ("w", c_double)], {})
complete(OmPose, [("p", OmVec3), ("q", OmQuat)], {})
complete(OmGrid, [("dim", c_int * 3), ("spacing", c_double), ("origin", OmVec3)], {})
complete(OmVoxelGrid, [("dim", c_int * 3), ("axis", OmMat3), ("origin", OmVec3)], {})
complete(OmSurface, [("nvert", c_int), ("ntri", c_int), ("x", c_void_p), ("tri_vert", c_void_p)], {})
complete(OmMeshSet, [("name", c_char * 64), ("nvert", c_int), ("vert", c_void_p)], {})
complete(OmTetMesh, [("nvert", c_int), ("ntet", c_int), ("nset", c_int), ("x", c_void_p), ("tet_vert", c_void_p), ("tet_label", c_void_p), ("set", POINTER(OmMeshSet))], {})
complete(OmBanetGrid, [("pose_world_grid", OmPose), ("voxel", c_double), ("dim", c_int * 3)], {})
complete(OmMask, [("grid", OmVoxelGrid), ("inside", c_void_p)], {})
complete(OmSdf, [("grid", OmGrid), ("d", c_void_p)], {})
complete(OmSdfDef, [("cookie", c_uint32), ("spacing", c_double), ("margin", c_double), ("smooth", c_double), ("iterations", c_int), ("is_raw", c_bool), ("max_node", c_int64), ("exact", c_double), ("grid", POINTER(OmGrid))], {})
complete(OmBsr, [("nvert", c_int), ("nedge", c_int), ("nblock", c_int), ("row_adr", c_void_p), ("col", c_void_p), ("edge_vert", c_void_p), ("edge_adr", c_void_p), ("value", c_void_p), ("exact", c_void_p)], {})
complete(OmSolverDef, [("preconditioner", c_int), ("max_iterations", c_int), ("tolerance", c_double), ("nworker", c_int), ("max_rhs", c_int), ("row_bound", c_double), ("cookie", c_uint32)], {"preconditioner": OmPreconditioner})
complete(OmSolveInfo, [("iterations", c_int), ("residual", c_double)], {})
complete(OmMaterial, [("young", c_double), ("poisson", c_double), ("law", c_int), ("volumetric", c_int), ("bulk", c_double), ("c10", c_double), ("c01", c_double), ("nterm", c_int), ("ogden_mu", c_double * 4), ("ogden_alpha", c_double * 4)], {"law": OmLaw, "volumetric": OmVolumetric})
complete(OmFemMesh, [("kind", c_int), ("nnode", c_int), ("nelem", c_int), ("nelem_node", c_int), ("x", c_void_p), ("elem_node", c_void_p), ("elem_material", c_void_p)], {"kind": OmElement})
complete(OmFemFaces, [("nface", c_int), ("nface_node", c_int), ("face_node", c_void_p), ("face_elem", c_void_p)], {})
complete(OmFemContact, [("nface", c_int * 2), ("face_node", c_void_p * 2), ("stiffness", c_double), ("reach", c_double)], {})
complete(OmFemDef, [("mesh", POINTER(OmFemMesh)), ("nmaterial", c_int), ("material", POINTER(OmMaterial)), ("density", c_void_p), ("locking", c_int), ("ncontact", c_int), ("contact", POINTER(OmFemContact)), ("is_projected", c_bool), ("nworker", c_int), ("cookie", c_uint32)], {"locking": OmLocking})
complete(OmFemTouch, [("force", OmVec3), ("torque", OmVec3), ("area", c_double), ("depth", c_double), ("energy", c_double)], {})
complete(OmFemExtra, [("eval", CFUNCTYPE(c_int, c_void_p, c_void_p, c_double, c_void_p, c_void_p, POINTER(OmBsr))), ("finish", CFUNCTYPE(c_int, c_void_p, c_void_p, c_double)), ("ctx", c_void_p)], {})
complete(OmFemPressure, [("nface", c_int), ("nface_node", c_int), ("face_node", c_void_p), ("traction", OmVec3), ("pressure", c_double)], {})
complete(OmFemLoad, [("body", OmVec3), ("force", c_void_p), ("npressure", c_int), ("pressure", POINTER(OmFemPressure)), ("fixed", c_void_p), ("goal", c_void_p), ("extra", POINTER(OmFemExtra))], {})
complete(OmFemStaticDef, [("load_begin", c_double), ("nstep", c_int), ("min_step", c_double), ("max_newton", c_int), ("tolerance", c_double), ("is_plain", c_bool), ("solver", OmSolverDef), ("progress", POINTER(OmProgress)), ("cookie", c_uint32)], {})
complete(OmFemReport, [("load", c_double), ("residual", c_double), ("force_scale", c_double), ("nstep", c_int), ("ncut", c_int), ("nnewton", c_int), ("ncg", c_int), ("min_volume", c_double), ("is_unstable", c_bool), ("history", c_double * 32), ("nhistory", c_int), ("reason", c_char * 160)], {})
complete(OmFemDynamicDef, [("integrator", c_int), ("is_consistent_mass", c_bool), ("mass_damping", c_double), ("min_step", c_double), ("max_newton", c_int), ("tolerance", c_double), ("solver", OmSolverDef), ("cookie", c_uint32)], {"integrator": OmIntegrator})
complete(OmFemMotion, [("x", c_void_p), ("v", c_void_p), ("time", c_double)], {})
complete(OmBanetSampleDef, [("seed", c_uint64), ("way", c_int), ("side", c_double), ("extent", c_double * 2), ("thickness", c_double * 2), ("max_dim", c_int * 3), ("share", c_double * 2), ("visible", c_double * 2), ("two_share", c_double), ("board_share", c_double), ("law", c_int), ("young", c_double * 2), ("poisson", c_double * 2), ("radius", c_double * 2), ("pull", c_double * 2), ("min_u", c_double), ("max_u", c_double), ("tolerance", c_double), ("min_volume", c_double), ("max_attempt", c_int), ("body", POINTER(OmTetMesh)), ("cookie", c_uint32)], {"way": OmBanetWay, "law": OmLaw})
complete(OmBanetSample, [("index", c_int64), ("is_camera", c_bool), ("has_board", c_bool), ("nregion", c_int), ("material", OmMaterial), ("board", c_double), ("mesh", OmTetMesh), ("surface", OmSurface), ("surface_vert", c_void_p), ("attached", c_void_p), ("grasped", c_void_p), ("center", c_int), ("force", OmVec3), ("rest", c_void_p), ("x", c_void_p), ("share", c_double), ("visible", c_double), ("u", c_void_p), ("seen", c_void_p), ("max_u", c_double), ("min_volume", c_double), ("residual", c_double), ("nattempt", c_int), ("nfail", c_int), ("nnewton", c_int), ("seconds", c_double)], {})
complete(OmBanetFacts, [("index", c_int), ("is_camera", c_int), ("has_board", c_int), ("nregion", c_int), ("nvert", c_int), ("ntet", c_int), ("nsurface", c_int), ("nattached", c_int), ("nattempt", c_int), ("nfail", c_int), ("young", c_double), ("poisson", c_double), ("force", c_double), ("share", c_double), ("visible", c_double), ("max_u", c_double), ("min_volume", c_double), ("residual", c_double), ("seconds", c_double)], {})
complete(OmBanetCells, [("fact", OmBanetFacts), ("grid", OmBanetGrid), ("ncell", c_int), ("cell", c_void_p), ("value", c_void_p), ("kind", c_void_p)], {})
complete(OmBanetDataDef, [("sample", OmBanetSampleDef), ("out_dir", c_char_p), ("nsample", c_int), ("first", c_int), ("shard", c_int), ("part", POINTER(c_char_p)), ("npart", c_int), ("npicture", c_int), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmBanetSummary, [("nsample", c_int), ("nmade", c_int), ("nattempt", c_int), ("nfail", c_int), ("ncamera", c_int), ("nboard", c_int), ("ntwo", c_int), ("median_u", c_double), ("max_u", c_double), ("median_visible", c_double), ("ncell", c_int64), ("nbyte", c_int64), ("seconds", c_double), ("sample_seconds", c_double)], {})
complete(OmBanetData, [("nsample", c_int), ("first", c_int), ("seed", c_uint64), ("hash", c_uint64), ("side", c_double), ("sample", POINTER(OmBanetCells))], {})
complete(OmBanetView, [("probability", c_void_p), ("shown", c_void_p), ("grasp", c_int), ("age", c_double)], {})
complete(OmBanetFuseDef, [("base", c_double), ("same", c_double), ("other", c_double), ("half_life", c_double), ("unseen", c_double), ("limit", c_double), ("cookie", c_uint32)], {})
complete(OmNetShape, [("c", c_int), ("d", c_int), ("h", c_int), ("w", c_int)], {})
complete(OmLayer, [("kind", c_int), ("name", c_char * 64), ("ninput", c_int), ("input", c_int * 4), ("shape", OmNetShape), ("kernel", c_int * 3), ("stride", c_int * 3), ("padding", c_int * 3), ("scale", c_int * 3), ("activation", c_int), ("slope", c_float), ("rate", c_float), ("ngroup", c_int), ("epsilon", c_float), ("momentum", c_float), ("mask", c_void_p), ("weight", c_int), ("bias", c_int), ("mean", c_int), ("variance", c_int)], {"kind": OmLayerKind, "activation": OmActivation})
complete(OmNetConv, [("channels", c_int), ("kernel", c_int * 3), ("stride", c_int * 3), ("padding", c_int * 3), ("has_bias", c_bool)], {})
complete(OmUnetDef, [("cookie", c_uint32), ("in_", OmNetShape), ("out_channels", c_int), ("nlevel", c_int), ("base_channels", c_int), ("activation", c_int), ("slope", c_float), ("norm", c_int), ("ngroup", c_int), ("dropout", c_float), ("mask", c_void_p)], {"activation": OmActivation, "norm": OmLayerKind})
complete(OmNetParameter, [("name", c_char * 64), ("ndim", c_int), ("dim", c_int * 5), ("adr", c_int64), ("num", c_int64), ("layer", c_int), ("is_trained", c_bool), ("is_decayed", c_bool)], {})
complete(OmNetRunDef, [("cookie", c_uint32), ("batch", c_int), ("type", c_int), ("is_training", c_bool), ("has_input_gradient", c_bool), ("nworker", c_int), ("seed", c_uint64), ("layout", c_int)], {"type": OmNetType, "layout": OmNetLayout})
complete(OmLoss_item, [("kind", c_int), ("scale", c_double)], {"kind": OmLossKind})
complete(OmLoss, [("nterm", c_int), ("term", OmLoss_item * 8), ("weight", c_void_p), ("cell_weight", c_void_p), ("sample_weight", c_void_p)], {})
complete(OmSchedule, [("kind", c_int), ("peak", c_double), ("start", c_double), ("end", c_double), ("warmup", c_double)], {"kind": OmScheduleKind})
complete(OmOptimDef, [("cookie", c_uint32), ("kind", c_int), ("beta1", c_double), ("beta2", c_double), ("epsilon", c_double), ("weight_decay", c_double), ("clip_norm", c_double), ("average", c_double), ("nworker", c_int)], {"kind": OmOptimKind})
complete(OmTrainGroup, [("rank", c_int), ("size", c_int), ("mean", CFUNCTYPE(c_int, c_void_p, c_void_p, c_int64)), ("ctx", c_void_p)], {})
complete(OmTrainBatch, [("is_validation", c_bool), ("epoch", c_int), ("count", c_int), ("sample", c_void_p), ("draw", c_void_p), ("in_", c_void_p), ("target", c_void_p), ("weight", c_void_p), ("cell_weight", c_void_p)], {})
complete(OmTrainEpoch, [("epoch", c_int), ("step", c_int64), ("train", c_double), ("valid", c_double), ("rate", c_double), ("grad_norm", c_double), ("seconds", c_double)], {})
complete(OmTrainDef, [("cookie", c_uint32), ("net", c_void_p), ("fill", OmTrainFillFn), ("ctx", c_void_p), ("ntrain", c_int), ("nvalid", c_int), ("batch", c_int), ("nepoch", c_int), ("valid_every", c_int), ("patience", c_int), ("loss", OmLoss), ("has_cell_weight", c_bool), ("optim", OmOptimDef), ("schedule", OmSchedule), ("type", c_int), ("nworker", c_int), ("seed", c_uint64), ("metric", CFUNCTYPE(c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_int)), ("on_epoch", CFUNCTYPE(None, c_void_p, POINTER(OmTrainEpoch))), ("dir", c_char_p), ("checkpoint_period", c_double), ("data_hash", c_uint64), ("group", POINTER(OmTrainGroup))], {"type": OmNetType})
complete(OmTrainResult, [("epoch", POINTER(OmTrainEpoch)), ("nepoch", c_int), ("nstep", c_int64), ("best_epoch", c_int), ("best_value", c_double), ("seconds", c_double), ("is_early", c_bool), ("is_resumed", c_bool)], {})
complete(OmBanetTrainDef, [("data", POINTER(OmBanetData)), ("out_dir", c_char_p), ("command", c_char_p), ("start", c_char_p), ("nvalid", c_int), ("channel", c_int * 5), ("ngroup", c_int), ("dropout", c_double), ("dim", c_int * 3), ("nimage", c_int), ("type", c_int), ("batch", c_int), ("nepoch", c_int), ("rate", c_double), ("shell", c_double), ("seed", c_uint64), ("nworker", c_int), ("group", POINTER(OmTrainGroup)), ("cookie", c_uint32)], {"type": OmNetType})
complete(OmBanetTrainSummary, [("dsc", c_double), ("tpr", c_double), ("ece", c_double), ("threshold", c_double), ("best_epoch", c_int), ("nepoch", c_int), ("nstep", c_int64), ("seconds", c_double), ("is_resumed", c_bool)], {})
complete(OmBanetEval, [("n", c_int), ("dsc", c_void_p), ("tpr", c_void_p), ("mean_dsc", c_double), ("mean_tpr", c_double), ("dsc_quartile", c_double * 3), ("tpr_quartile", c_double * 3), ("bin_predicted", c_double * 15), ("bin_true", c_double * 15), ("ece", c_double), ("ncell", c_int64), ("ms", c_double)], {})
complete(OmVolume, [("grid", OmVoxelGrid), ("type", c_int), ("voxel", c_void_p), ("slope", c_double), ("inter", c_double)], {"type": OmVoxelType})
complete(OmSegment, [("name", c_char * 128), ("id", c_char * 128), ("layer", c_int), ("value", c_int)], {})
complete(OmVolumeInfo, [("dim", c_int * 3), ("nentry", c_int), ("has_layers", c_bool), ("unit", c_double), ("has_space", c_bool), ("nsegment", c_int), ("segment", POINTER(OmSegment))], {})
complete(OmPicture, [("width", c_int), ("height", c_int), ("nchannel", c_int), ("pixel", c_void_p)], {})
complete(OmLens, [("fx", c_double), ("fy", c_double), ("cx", c_double), ("cy", c_double), ("k1", c_double), ("k2", c_double), ("p1", c_double), ("p2", c_double), ("k3", c_double)], {})
complete(OmCamera, [("pose_world_camera", OmPose), ("width", c_int), ("height", c_int), ("fov", c_double), ("near_m", c_double), ("far_m", c_double), ("lens", OmLens)], {})
complete(OmWindow, [("column", c_int), ("row", c_int), ("width", c_int), ("height", c_int)], {})
complete(OmSenseLook, [("red", c_double), ("green", c_double), ("blue", c_double), ("gloss", c_double), ("metal", c_double), ("crease", c_double), ("is_smooth", c_bool), ("is_checker", c_bool), ("texture", c_int)], {"texture": OmSenseTexture})
complete(OmSenseRange, [("hue_min", c_double), ("hue_max", c_double), ("saturation_min", c_double), ("saturation_max", c_double), ("value_min", c_double), ("value_max", c_double)], {})
complete(OmSenseOptions, [("samples", c_int), ("has_shadow", c_bool), ("nworker", c_int), ("window", OmWindow)], {})
complete(OmDepthNoise, [("a", c_double), ("b", c_double), ("min_grazing", c_double), ("dropout", c_double), ("seed", c_uint64), ("nworker", c_int)], {})
complete(OmVisibility, [("npoint", c_int), ("nseen", c_int), ("naway", c_int), ("noutside", c_int), ("nhidden", c_int)], {})
complete(OmScan, [("time", c_double), ("npoint", c_int), ("ntri", c_int), ("x", c_void_p), ("normal", c_void_p), ("tri_vert", c_void_p), ("noise", c_double), ("has_camera", c_bool), ("camera", OmCamera), ("pixel", c_void_p)], {})
complete(OmSceneTissue, [("engine", c_char * 64), ("weights", c_char * 512), ("source", c_int), ("size", OmVec3), ("cells", OmVec3), ("world_cells", OmVec3), ("file", c_char * 512), ("unit", c_double), ("up", OmVec3), ("view", OmVec3), ("law", c_int), ("is_averaged", c_bool), ("friction", c_double), ("has_board", c_bool), ("young", c_double), ("poisson", c_double), ("density", c_double), ("mesh_factor", c_double), ("rayleigh_mass", c_double), ("rayleigh_stiffness", c_double), ("gravity", c_double), ("cluster_spacing", c_double), ("cluster_radius", c_double), ("cluster_stiffness", c_double)], {})
complete(OmSceneModel, [("label", c_int), ("max_volume", c_double), ("edge", c_double), ("world_edge", c_double), ("thickness", c_double), ("side", c_char * 64), ("half_length", c_double), ("half_width", c_double), ("attach", c_char * 64), ("tumour_radius", c_double), ("tumour_shift", OmVec3), ("tumour_range", OmVec3), ("attach_turn", c_double)], {})
complete(OmSceneAttach, [("kind", c_int), ("share_min", c_double), ("share_max", c_double), ("lo", OmVec3), ("hi", OmVec3), ("stiffness", c_double), ("foundation", c_double)], {})
complete(OmSceneBelief, [("kind", c_int), ("shift", OmVec3), ("grow", c_double), ("ratio", c_double), ("seed", c_int), ("share", c_double), ("lo", OmVec3), ("hi", OmVec3), ("stiffness", c_double), ("foundation", c_double)], {})
complete(OmSceneRoiBelief, [("shift", OmVec3)], {})
complete(OmSceneRegistration, [("shift", OmVec3), ("turn", OmVec3)], {})
complete(OmSceneRoi, [("is_random", c_bool), ("center", OmVec3), ("radius", c_double), ("margin", c_double)], {})
complete(OmSceneCamera, [("distance", c_double), ("elevation", c_double), ("fov", c_double), ("width", c_int), ("height", c_int), ("focal", c_double * 2), ("center", c_double * 2), ("distortion", c_double * 5)], {})
complete(OmSceneWorld, [("young_factor", c_double), ("density_factor", c_double), ("law", c_int), ("poisson", c_double), ("friction", c_double), ("tool_noise", c_double), ("has_depth_noise", c_bool), ("narm", c_int), ("force_noise", c_double), ("grip_friction", c_double), ("grip_force", c_double), ("tear_strength", c_double)], {})
complete(OmSceneTask, [("grid", c_int), ("force_threshold", c_double), ("watch_force", c_bool), ("force_margin", c_double), ("max_height", c_double), ("pull_step", c_double), ("visibility", c_double), ("visibility_margin", c_double), ("speed", c_double), ("grasp_radius", c_double), ("time_step", c_double), ("max_actions", c_int), ("retract", c_double), ("wrist_turn", c_double), ("ahead", c_int)], {})
complete(OmSceneUpdate, [("is_enabled", c_bool), ("latency", c_double), ("keep", c_int), ("min_lift", c_double), ("rest", c_double), ("network", c_char * 512), ("is_checked", c_bool), ("learns_modulus", c_bool), ("learns_modulus_by_shape", c_bool)], {})
complete(OmSceneMonitor, [("is_enabled", c_bool), ("limit", c_double * 3), ("hysteresis", c_double), ("rate", c_double), ("npoint", c_int), ("quantile", c_double), ("region", c_int), ("part_limit", c_double * 2), ("part_share", c_double), ("fold_factor", c_double), ("is_fold_at_rest", c_bool)], {})
complete(OmScene, [("engines", POINTER(OmEngineSet)), ("name", c_char * 64), ("path", c_char * 512), ("data_root", c_char * 512), ("calibrated", c_char * 512), ("seed", c_int), ("tissue", OmSceneTissue), ("model", OmSceneModel), ("attach", OmSceneAttach), ("believed", OmSceneBelief), ("believed_roi", OmSceneRoiBelief), ("registration", OmSceneRegistration), ("roi", OmSceneRoi), ("endoscope", OmSceneCamera), ("rgbd", OmSceneCamera), ("world", OmSceneWorld), ("task", OmSceneTask), ("update", OmSceneUpdate), ("monitor", OmSceneMonitor)], {})
complete(OmSiteMaterial, [("name", c_char * 64), ("young", c_double), ("poisson", c_double), ("density", c_double)], {})
complete(OmSite, [("role", c_int), ("mesh", OmTetMesh), ("attach_stiffness", c_double), ("attach_foundation", c_double), ("attach_area", c_void_p), ("attach_spring", c_void_p), ("pose_world_task", OmPose), ("pose_world_field", OmPose), ("half_size", OmVec3), ("has_ground", c_bool), ("has_organ", c_bool), ("organ", OmSurface), ("organ_sdf", OmSdf), ("nroi", c_int), ("roi_x", c_void_p), ("roi_n", c_void_p), ("roi", OmSurface), ("roi_center", OmVec3), ("nmaterial", c_int), ("material", OmSiteMaterial * 16), ("young", c_double), ("density", c_double), ("poisson", c_double), ("gravity", OmVec3)], {"role": OmSiteRole})
complete(OmMatchDef, [("scene", POINTER(OmScene)), ("site", POINTER(OmSite)), ("ncandidate", c_int), ("candidate", c_void_p), ("foundation", c_double), ("contact", c_double), ("nhypothesis", c_int), ("seed", c_uint64), ("moved", c_double), ("min_seen", c_double), ("min_motion", c_double), ("max_residual", c_double), ("is_unchecked", c_bool), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmMatchView, [("mesh", POINTER(OmTetMesh)), ("surface", POINTER(OmSurface)), ("surface_vert", c_void_p), ("surface_of", c_void_p), ("ncandidate", c_int), ("candidate", c_void_p), ("area", c_void_p), ("edge", c_double), ("foundation", c_double)], {})
complete(OmMatchGrasp, [("arm", c_int), ("pose_world_grasp", OmPose), ("pose_world_now", OmPose), ("radius", c_double), ("nvert", c_int), ("vert", c_void_p)], {})
complete(OmMatchPull, [("tri", c_int), ("bary", c_double * 3), ("goal", OmVec3), ("normal", OmVec3), ("across", c_double), ("along", c_double)], {})
complete(OmMatchLoad, [("spring", c_void_p), ("ngrasp", c_int), ("grasp", POINTER(OmMatchGrasp)), ("npull", c_int), ("pull", POINTER(OmMatchPull)), ("max_newton", c_int), ("tolerance", c_double)], {})
complete(OmMatchRest, [("nnewton", c_int), ("motion", c_double), ("residual", c_double), ("energy", c_double)], {})
complete(OmAcquisition, [("scan", OmScan), ("ngrasp", c_int), ("grasp", OmMatchGrasp * 2), ("time", c_double), ("x_twin", c_void_p), ("attached", c_void_p)], {})
complete(OmMatchEstimate, [("nvert", c_int), ("probability", c_void_p), ("uncertainty", c_void_p), ("stiffness", c_void_p), ("attached", c_void_p), ("nacquisition", c_int), ("x", c_void_p), ("has_shape", c_bool), ("shape", c_void_p), ("shape_median", c_double), ("seen_share", c_double), ("moved_share", c_double), ("before_median", c_double), ("before_p90", c_double), ("after_median", c_double), ("after_p90", c_double), ("before_mean", c_double), ("after_mean", c_double), ("choice", c_int), ("is_accepted", c_bool), ("reason", c_char * 256), ("has_look_next", c_bool), ("look_next", OmVec3), ("fit_ms", c_double), ("infer_ms", c_double), ("check_ms", c_double), ("total_ms", c_double)], {})
complete(OmMatchAdvice, [("probability", c_void_p), ("weight", c_double), ("nset", c_int), ("set", c_void_p * 8), ("present", c_void_p)], {})
complete(OmMatchTrial, [("median", c_double), ("p90", c_double), ("mean", c_double), ("is_at_rest", c_bool)], {})
complete(OmBanetUpdateDef, [("match", c_void_p), ("net", c_void_p), ("side", c_double), ("estimate", OmBanetEstimateFn), ("estimate_ctx", c_void_p), ("fuse", OmBanetFuseDef), ("threshold", c_double), ("weight", c_double), ("reach", c_double), ("ntry", c_int), ("is_corrected", c_bool), ("tries_last_corrected", c_bool), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmBanetAdvice, [("nvert", c_int), ("nacquisition", c_int), ("view", c_void_p), ("probability", c_void_p), ("nused", c_int), ("reason", c_char * 256), ("pairs_ms", c_double), ("network_ms", c_double), ("total_ms", c_double)], {})
complete(OmMatchLiveDef, [("match", c_void_p), ("nfollow", c_int), ("nfit", c_int), ("fit_stiffness", c_double), ("along", c_double), ("release", c_double), ("max_distance", c_double), ("min_cosine", c_double), ("max_median", c_double), ("max_p95", c_double), ("min_paired", c_double), ("max_empty", c_double), ("nrestart", c_int), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmMatchPairs, [("npoint", c_int), ("tri", c_void_p), ("bary", c_void_p), ("weight", c_void_p), ("x_rest", c_void_p), ("nvert", c_int), ("x", c_void_p), ("median", c_double), ("p90", c_double), ("p95", c_double), ("paired", c_double), ("empty", c_double), ("is_restarted", c_bool), ("is_lost", c_bool), ("reason", c_char * 256), ("ms", c_double)], {})
complete(OmTissueDef, [("engine", POINTER(OmTissueEngine)), ("options", c_void_p), ("input", POINTER(OmEngineInput)), ("mesh", POINTER(OmTetMesh)), ("nmaterial", c_int), ("material", POINTER(OmMaterial)), ("material_default", OmMaterial), ("density", c_double), ("material_density", c_void_p), ("rayleigh_mass", c_double), ("rayleigh_stiffness", c_double), ("gravity", OmVec3), ("attachment_stiffness", c_double), ("attachment_springs", c_void_p), ("max_newton", c_int), ("newton_tolerance", c_double), ("is_averaged", c_bool), ("solver", OmSolverDef), ("cookie", c_uint32)], {})
complete(OmTissueReport, [("iterations", c_int), ("residual", c_double), ("substeps", c_int), ("newton", c_int), ("newton_residual", c_double), ("ninverted", c_int), ("energy_gain", c_double), ("is_unguarded", c_bool)], {})
complete(OmTissueObstacle, [("distance", OmDistanceFn), ("ctx", c_void_p), ("offset", c_double), ("thickness", c_double), ("is_plane", c_bool), ("has_bounds", c_bool), ("lo", OmVec3), ("hi", OmVec3), ("pose_begin", OmPose), ("pose_end", OmPose), ("friction", c_double), ("force", OmVec3), ("torque", OmVec3), ("ncontact", c_int), ("penetration", c_double)], {})
complete(OmTissueForces, [("grasp", OmVec3 * 2), ("pull", OmVec3 * 2), ("attachment", OmVec3), ("contact", OmVec3), ("external", OmVec3), ("weight", OmVec3)], {})
complete(OmTissueEnergy, [("elastic", c_double), ("kinetic", c_double), ("gravity", c_double), ("spring", c_double)], {})
complete(OmEmbedding, [("npoint", c_int), ("tet", c_void_p), ("bary", c_void_p), ("tet_vert", c_void_p)], {})
complete(OmAssembly, [("x", c_void_p), ("v", c_void_p), ("mass", c_double), ("stiffness", c_double), ("force", c_double), ("lag", c_double), ("spring", c_double), ("spring_lag", c_double), ("is_exact", c_bool), ("is_turned", c_bool)], {})
complete(OmTissueCheck, [("ncrushed", c_int), ("nbarrier", c_int), ("ninverted", c_int), ("elastic_begin", c_double), ("elastic_end", c_double)], {})
complete(OmEngineNumber, [("name", c_char_p), ("value", c_double)], {})
complete(OmEngineInput, [("file", c_char_p), ("nnumber", c_int), ("number", POINTER(OmEngineNumber))], {})
complete(OmTissueEngine, [("version", c_int), ("name", c_char_p), ("summary", c_char_p), ("number", POINTER(c_char_p)), ("has_law", c_bool), ("has_forces", c_bool), ("has_springs", c_bool), ("can_average", c_bool), ("needs_file", c_bool), ("load", CFUNCTYPE(c_int, POINTER(OmEngineInput), POINTER(c_void_p))), ("unload", CFUNCTYPE(None, c_void_p)), ("create", CFUNCTYPE(c_int, c_void_p)), ("destroy", CFUNCTYPE(None, c_void_p)), ("create_work", CFUNCTYPE(c_int, c_void_p, c_void_p)), ("destroy_work", CFUNCTYPE(None, c_void_p)), ("assemble", CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, POINTER(OmAssembly))), ("step", CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_double, c_int, POINTER(OmTissueObstacle), POINTER(OmTissueReport))), ("lump_mass", CFUNCTYPE(c_int, c_void_p, c_void_p)), ("get_state_size", CFUNCTYPE(c_size_t, c_void_p)), ("sync_state", CFUNCTYPE(None, c_void_p, c_void_p)), ("add_internal_force", CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_void_p, POINTER(OmVec3))), ("get_measure", CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_void_p)), ("get_energy", CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p)), ("eval_balance", CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)), ("check", CFUNCTYPE(None, c_void_p, c_void_p, c_void_p, c_void_p, c_bool, POINTER(OmTissueCheck))), ("get_memory", CFUNCTYPE(c_size_t, c_void_p, c_void_p))], {})
complete(OmEngineSet, [("nengine", c_int), ("engine", POINTER(OmTissueEngine) * 32)], {})
complete(OmBodyForces, [("grasp", OmVec3 * 2), ("pull", OmVec3 * 2), ("attachment", OmVec3), ("contact", OmVec3), ("weight", OmVec3)], {})
complete(OmBodyReport, [("iterations", c_int), ("residual", c_double), ("substeps", c_int), ("ncontact", c_int), ("penetration", c_double), ("ninverted", c_int), ("energy_gain", c_double)], {})
complete(OmBodyParts, [("input", OmEngineInput), ("number", OmEngineNumber * 8), ("file", c_char * 1024), ("material", OmMaterial * 16), ("density", c_double * 16)], {})
complete(OmCalibrationParam, [("name", c_char * 48), ("lo", c_double), ("hi", c_double), ("start", c_double), ("is_log", c_bool), ("unit", c_double)], {})
complete(OmCalibrationLabel, [("experiment", c_int), ("landmark", c_int), ("level", c_double)], {})
complete(OmCalibrationDef, [("title", c_char_p), ("eval", OmCalibrationFn), ("ctx", c_void_p), ("eval_finer", OmCalibrationFinerFn), ("problem", c_uint64), ("nparam", c_int), ("param", OmCalibrationParam * 8), ("nerror", c_int), ("label", POINTER(OmCalibrationLabel)), ("nexperiment", c_int), ("nlandmark", c_int), ("experiment", POINTER(c_char_p)), ("landmark", POINTER(c_char_p)), ("norm", c_int), ("norm_size", c_double), ("noise", c_double), ("global_", c_int), ("population", c_int), ("max_generations", c_int), ("local", c_int), ("max_local", c_int), ("local_range", c_double), ("tolerance", c_double), ("patience", c_int), ("unfit", c_double), ("rise", c_double), ("seed", c_uint64), ("nworker", c_int), ("out_dir", c_char_p), ("cookie", c_uint32)], {"norm": OmCalibrationNorm, "global_": OmCalibrationGlobal, "local": OmCalibrationLocal})
complete(OmCalibrationProfile, [("x", c_double * 17), ("cost", c_double * 17), ("lo", c_double), ("hi", c_double), ("mesh_lo", c_double), ("mesh_hi", c_double), ("is_open_lo", c_bool), ("is_open_hi", c_bool), ("partner_rho", c_double), ("partner", c_int), ("is_determined", c_bool)], {})
complete(OmCalibrationResult, [("outcome", c_int), ("nparam", c_int), ("nerror", c_int), ("neval", c_int), ("nnew", c_int), ("nglobal", c_int), ("nlocal", c_int), ("nprofile", c_int), ("ngeneration", c_int), ("best", c_double * 8), ("cost_start", c_double), ("cost_global", c_double), ("cost", c_double), ("error_start", c_void_p), ("error", c_void_p), ("trace", c_void_p), ("has_profile", c_bool), ("has_mesh", c_bool), ("mesh_ratio", c_double), ("mesh_difference", c_double), ("mesh_cost", c_double), ("is_of_mesh", c_bool), ("profile", OmCalibrationProfile * 8)], {"outcome": OmCalibrationOutcome})
complete(OmContactPlane, [("point", OmVec3), ("normal", OmVec3)], {})
complete(OmContactDef, [("nobstacle", c_int), ("obstacle", POINTER(OmTissueObstacle)), ("offset", c_double), ("stiffness", c_double), ("recover_speed", c_double), ("friction", c_double), ("max_iterations", c_int), ("cookie", c_uint32)], {})
complete(OmContactReport, [("tissue", OmTissueReport), ("nsolve", c_int), ("ncontact", c_int), ("penetration", c_double), ("force", OmVec3), ("nobstacle", c_int), ("obstacle", POINTER(OmTissueObstacle)), ("is_settled", c_bool)], {})
complete(OmProbeDef, [("shape", c_int), ("size", OmVec3), ("rounding", c_double), ("radius", c_double), ("length", c_double), ("surface", POINTER(OmSurface)), ("cookie", c_uint32)], {"shape": OmProbeShape})
complete(OmPressDef, [("obstacle", OmTissueObstacle), ("method", c_int), ("surface", POINTER(OmSurface)), ("ntri", c_int), ("stiffness", c_double), ("friction", c_double), ("tolerance", c_double), ("max_iterations", c_int), ("reuse", c_int), ("direction", OmVec3), ("reach", c_double), ("cookie", c_uint32)], {"method": OmPressMethod})
complete(OmPressReport, [("tissue", OmTissueReport), ("nsolve", c_int), ("ncolumn", c_int), ("ncontact", c_int), ("is_settled", c_bool), ("force", OmVec3), ("torque", OmVec3), ("area", c_double), ("penetration", c_double), ("complementarity", c_double), ("vert", c_void_p), ("point", c_void_p), ("normal", c_void_p), ("push", c_void_p), ("gap", c_void_p)], {})
complete(OmCalibrationPath, [("name", c_char_p), ("kind", c_int), ("point", OmVec3), ("direction", OmVec3), ("along", OmVec3), ("radius", c_double), ("probe", c_void_p), ("method", c_int), ("contact_ntri", c_int), ("friction", c_double), ("speed", c_double), ("time_step", c_double), ("settle", c_double), ("nlevel", c_int), ("level", c_void_p)], {"kind": OmCalibrationPathKind, "method": OmPressMethod})
complete(OmCalibrationSeen, [("path", c_int), ("level", c_int), ("landmark", c_int), ("x", OmVec3)], {})
complete(OmCalibrationTissueDef, [("build", OmCalibrationBuildFn), ("ctx", c_void_p), ("contact", POINTER(OmContactDef)), ("npath", c_int), ("path", POINTER(OmCalibrationPath)), ("nlandmark", c_int), ("landmark", POINTER(c_char_p)), ("rest", c_void_p), ("nobservation", c_int), ("observation", POINTER(OmCalibrationSeen)), ("force_scale", c_double), ("ncloud_point", c_int), ("cloud_point", c_void_p), ("cookie", c_uint32)], {})
complete(OmAheadDef, [("cookie", c_uint32), ("scene", POINTER(OmScene)), ("site", POINTER(OmSite)), ("npoint", c_int), ("max_step", c_int), ("is_repeated", c_bool)], {})
complete(OmModulusDef, [("cookie", c_uint32), ("scene", POINTER(OmScene)), ("site", POINTER(OmSite)), ("match", c_void_p), ("by_force", c_bool), ("by_shape", c_bool)], {})
complete(OmPsm, [("pose_world_rcm", OmPose), ("wrist", c_double), ("q_min", c_double * 6), ("q_max", c_double * 6), ("jaw_min", c_double), ("jaw_max", c_double)], {})
complete(OmPsmCapsule, [("a", OmVec3), ("b", OmVec3), ("radius", c_double)], {})
complete(OmArmObservation, [("time", c_double), ("tip", OmPose), ("q", c_double * 6), ("jaw", c_double), ("jaw_speed", c_double), ("jaw_goal", c_double), ("is_moving", c_bool), ("has_wrench", c_bool), ("force", OmVec3), ("torque", OmVec3)], {})
complete(OmWorldPicture, [("time", c_double), ("camera", OmCamera), ("window", OmWindow), ("color", OmPicture)], {})
complete(OmDepthPicture, [("time", c_double), ("camera", OmCamera), ("depth", c_void_p), ("color", OmPicture)], {})
complete(OmObservation, [("time", c_double), ("narm", c_int), ("arm", OmArmObservation * 2), ("visibility", c_double), ("endoscope", OmWorldPicture), ("rgbd", OmDepthPicture)], {})
complete(OmWorldOps, [("destroy", CFUNCTYPE(None, POINTER(OmWorld))), ("move", CFUNCTYPE(c_int, POINTER(OmWorld), c_int, OmPose, c_double)), ("set_jaw", CFUNCTYPE(c_int, POINTER(OmWorld), c_int, c_double)), ("stop", CFUNCTYPE(None, POINTER(OmWorld), c_int)), ("advance", CFUNCTYPE(c_int, POINTER(OmWorld), c_double)), ("observe", CFUNCTYPE(c_int, POINTER(OmWorld), c_uint, POINTER(OmObservation))), ("reset", CFUNCTYPE(c_int, POINTER(OmWorld))), ("state_size", CFUNCTYPE(c_size_t, POINTER(OmWorld))), ("save", CFUNCTYPE(None, POINTER(OmWorld), c_void_p)), ("restore", CFUNCTYPE(None, POINTER(OmWorld), c_void_p)), ("set_window", CFUNCTYPE(None, POINTER(OmWorld), OmWindow))], {})
complete(OmWorld, [("ops", POINTER(OmWorldOps)), ("narm", c_int), ("sources", c_uint), ("psm", POINTER(OmPsm) * 2)], {})
complete(OmCloudDef, [("cookie", c_uint32), ("site", POINTER(OmSite)), ("psm", POINTER(OmPsm) * 2), ("clearance", c_double), ("tool_margin", c_double), ("reach", c_double)], {})
complete(OmCloudField, [("def_", OmCloudDef), ("pose_task_world", OmPose), ("lo", OmVec3), ("hi", OmVec3), ("ncapsule", c_int), ("capsule", OmPsmCapsule * 8)], {})
complete(OmCloud, [("time", c_double), ("n", c_int), ("x", c_void_p), ("pixel", c_void_p)], {})
complete(OmMonitorDef, [("cookie", c_uint32), ("settings", OmSceneMonitor), ("space", OmCloudDef), ("use_color", c_bool), ("tissue", OmSenseRange), ("nray", c_int), ("max_age", c_double)], {})
complete(OmMonitorFrame, [("time", c_double), ("age", c_double), ("distance", c_double), ("rest", c_double), ("mu", c_double), ("part", c_double), ("mean", c_double), ("npoint", c_int), ("nmoved", c_int), ("nrest", c_int), ("state", c_int), ("is_stale", c_bool), ("is_blind", c_bool), ("nstale", c_int), ("nblind", c_int), ("unseen", c_double)], {})
complete(OmExposure, [("is_known", c_bool), ("exposes", c_bool), ("npull", c_int), ("fold", c_int)], {"fold": OmPlanVerb})
complete(OmArmSituation, [("at", c_int), ("in_hand", c_int), ("is_closed", c_bool), ("is_max_height", c_bool), ("is_max_force", c_bool), ("nlift", c_int)], {})
complete(OmSituation, [("n", c_int), ("is_fixed", c_bool * 256), ("is_above_roi", c_bool * 256), ("is_forbidden", c_bool * 256), ("reachable", c_uint8 * 256), ("tried", c_uint8 * 256), ("arm", OmArmSituation * 2), ("exposure", OmExposure * 256), ("is_visible", c_bool), ("spacing", c_double), ("center", c_void_p)], {})
complete(OmPlanAction, [("verb", c_int), ("arm", c_int), ("block", c_int), ("time", c_int)], {"verb": OmPlanVerb})
complete(OmPlan, [("outcome", c_int), ("n", c_int), ("naction", c_int), ("action", OmPlanAction * 64), ("grasp_block", c_int), ("grasp_arm", c_int), ("cost", c_int64 * 6), ("is_optimal", c_bool), ("is_reground", c_bool), ("ground_time", c_double), ("solve_time", c_double)], {"outcome": OmStatus})
complete(OmPlannerDef, [("cookie", c_uint32), ("horizon", c_int), ("max_lift", c_int), ("program", c_char_p), ("seed", c_uint32), ("has_all_distances", c_bool), ("has_both_arms", c_bool), ("conflict_limit", c_int), ("time_limit", c_double)], {})
complete(OmPreplanPoint, [("block", c_int), ("arm", c_int), ("verdict", c_int), ("is_tried", c_bool), ("exposes", c_bool), ("npull", c_int), ("fold", c_int), ("visibility", c_double), ("force", c_double), ("naction", c_int), ("nstep", c_int), ("ntwin", c_int), ("ntwin_exposed", c_int), ("ntwin_alike", c_int), ("spread", c_double), ("warning", c_int), ("force_most", c_double)], {"verdict": OmPreplanVerdict, "fold": OmPlanVerb})
complete(OmPreplan, [("scene", c_char * 64), ("seed", c_int), ("n", c_int), ("point", OmPreplanPoint * 256), ("chosen", c_int), ("is_exposing", c_bool), ("visibility", c_double), ("force_limit", c_double), ("ntried", c_int), ("nexposing", c_int), ("nstep", c_int64), ("reason", c_char * 256)], {})
complete(OmPreplanDef, [("cookie", c_uint32), ("scene", POINTER(OmScene)), ("nworker", c_int), ("nlowest", c_int), ("nagain", c_int)], {})
complete(OmScanDef, [("cookie", c_uint32), ("space", OmCloudDef), ("use_color", c_bool), ("tissue", OmSenseRange), ("tool", OmSenseRange), ("spacing", c_double), ("max_jump", c_double), ("min_cosine", c_double), ("min_area", c_double), ("margin", c_int), ("noise_a", c_double), ("noise_b", c_double)], {})
complete(OmScanRegion, [("is_box", c_bool), ("u", c_double), ("v", c_double), ("radius", c_double), ("column", c_int), ("row", c_int), ("width", c_int), ("height", c_int)], {})
complete(OmUpdateDef, [("cookie", c_uint32), ("scan", OmScanDef), ("settings", OmSceneUpdate), ("estimate", OmEstimateFn), ("estimate_ctx", c_void_p), ("timing", c_int), ("replay_tick", c_void_p), ("nreplay", c_int)], {"timing": OmUpdateTiming})
complete(OmUpdateEvent, [("stage", c_int), ("index", c_int), ("tick", c_int), ("time", c_double), ("acquisition", POINTER(OmAcquisition)), ("nacquisition", c_int), ("estimate", POINTER(OmMatchEstimate)), ("reason", c_char_p), ("was_attached", c_void_p)], {"stage": OmUpdateStage})
complete(OmRetractSample, [("time", c_double), ("visibility", c_double), ("visibility_world", c_double), ("force", c_double), ("force_world", c_double), ("height", c_double), ("speed_rate", c_double), ("mu", c_double), ("warning", c_int)], {})
complete(OmRetractAction, [("verb", c_int), ("arm", c_int), ("block", c_int), ("begin", c_double), ("end", c_double), ("outcome", c_int), ("visibility", c_double), ("force_max", c_double), ("force_world_max", c_double), ("is_replanned", c_bool), ("plan", c_int), ("turn", c_double)], {"verb": OmPlanVerb, "outcome": OmActionOutcome})
complete(OmRetractUpdate, [("stage", c_int), ("is_followed", c_bool), ("reason", c_char * 256), ("nacquisition", c_int), ("start_tick", c_int), ("end_tick", c_int), ("start", c_double), ("end", c_double), ("nattached_before", c_int), ("nattached_after", c_int), ("seen_share", c_double), ("before_median", c_double), ("after_median", c_double), ("estimate_ms", c_double), ("mu_before", c_double), ("mu_after", c_double), ("part_before", c_double), ("part_after", c_double)], {"stage": OmUpdateStage})
complete(OmRetractResult, [("outcome", c_int), ("is_exposed", c_bool), ("reason", c_char * 256), ("visibility_start", c_double), ("visibility_end", c_double), ("visibility_world_end", c_double), ("force_max", c_double), ("force_world_max", c_double), ("force_more", c_double), ("force_less", c_double), ("force_factor", c_double), ("young_factor", c_double), ("nmodulus", c_int), ("is_modulus_by_shape", c_bool), ("nforce", c_int), ("nforce_world", c_int), ("time", c_double), ("path", c_double), ("wall_time", c_double), ("twin_step_ms", c_double), ("nplan", c_int), ("nahead", c_int), ("nahead_step", c_int64), ("plan_ms_median", c_double), ("plan_ms_max", c_double), ("naction", c_int), ("action", POINTER(OmRetractAction)), ("nsample", c_int), ("sample", POINTER(OmRetractSample)), ("hold", c_int), ("nhold", c_int), ("ncommand", c_int), ("nmonitor", c_int), ("nwarning", c_int * 3), ("mu_max", c_double), ("nslip", c_int), ("nempty", c_int), ("nmeasured", c_int), ("measured_off", c_double), ("ndrawn", c_int), ("world_ntorn", c_int), ("nacquisition", c_int), ("nupdate", c_int), ("update", POINTER(OmRetractUpdate)), ("is_settled", c_bool), ("twin_shift", c_double), ("world_shift", c_double), ("nadded", c_int), ("has_slid", c_bool), ("twin_nbad", c_int), ("world_nbad", c_int), ("twin_nvert", c_int), ("twin_ntet", c_int), ("world_nvert", c_int), ("world_ntet", c_int), ("hash", c_uint64)], {"outcome": OmRetractOutcome, "hold": OmHold})
complete(OmLoopMotion, [("arm", c_int), ("verb", c_int), ("tip", OmVec3), ("goal", OmVec3), ("nplace", c_int)], {"verb": OmPlanVerb})
complete(OmMotionLaw, [("ctx", c_void_p), ("next", CFUNCTYPE(c_int, c_void_p, POINTER(OmLoopMotion), POINTER(OmVec3)))], {})
complete(OmLoopListener, [("ctx", c_void_p), ("on_begin", CFUNCTYPE(c_int, c_void_p, c_void_p)), ("on_tick", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmRetractSample))), ("on_plan", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmSituation), POINTER(OmPlan))), ("on_action_begin", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmPlanAction))), ("on_action_end", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmRetractAction))), ("on_end", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmRetractResult))), ("on_update", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmUpdateEvent))), ("on_command", CFUNCTYPE(c_int, c_void_p, c_void_p, POINTER(OmLoopCommand))), ("on_hold", CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_char_p)), ("on_warning", CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, POINTER(OmMonitorFrame)))], {})
complete(OmLoopDef, [("cookie", c_uint32), ("task", POINTER(OmSceneTask)), ("world", POINTER(OmWorld)), ("twin", c_void_p), ("planner", c_void_p), ("truth", c_void_p), ("listener", POINTER(OmLoopListener)), ("nlistener", c_int), ("updater", c_void_p), ("preplan", POINTER(OmPreplan)), ("is_by_twin", c_bool), ("ahead", c_void_p), ("modulus", c_void_p), ("law", OmMotionLaw), ("monitor", c_void_p), ("is_attended", c_bool), ("needs_approval", c_bool), ("max_age", c_double), ("max_lag", c_double), ("is_settled", c_bool), ("nadded", c_int), ("wall_begin", c_double)], {})
complete(OmLoopCommand, [("kind", c_int), ("block", c_int), ("value", c_double)], {"kind": OmLoopCommandKind})
complete(OmRetractDef, [("cookie", c_uint32), ("scene", POINTER(OmScene)), ("out_dir", c_char_p), ("program", c_char_p), ("frame_every", c_int), ("nworker", c_int), ("preplan", POINTER(OmPreplan)), ("supervise", CFUNCTYPE(c_int, c_void_p, c_void_p)), ("supervise_ctx", c_void_p), ("law", OmMotionLaw), ("has_both_arms", c_bool), ("needs_approval", c_bool), ("records_acquisitions", c_bool), ("has_recording", c_bool), ("records_observations", c_bool)], {})
complete(OmRetractEstimate, [("twin_nvert", c_int), ("twin_ntet", c_int), ("world_nvert", c_int), ("world_ntet", c_int), ("twin_nattached", c_int), ("world_nattached", c_int), ("nblock", c_int), ("ngrasp", c_int), ("visibility", c_double), ("is_settled", c_bool), ("has_slid", c_bool), ("nplanned", c_int), ("begin_time", c_double), ("time_rate", c_double), ("picture_bytes", c_double)], {})
complete(OmForceCalibration, [("nrun", c_int), ("median", c_double), ("lower_quartile", c_double), ("upper_quartile", c_double), ("max", c_double), ("threshold", c_double), ("margin", c_double), ("more_median", c_double), ("npair", c_int)], {})
complete(OmSearchResult, [("ngrasp", c_int), ("nsequence", c_int), ("nexposed", c_int), ("first_block", c_int), ("visibility", c_double), ("force", c_double), ("block", c_int), ("first", c_int), ("second", c_int), ("naction", c_int)], {"first": OmPlanVerb, "second": OmPlanVerb})
complete(OmAuditDef, [("cookie", c_uint32), ("planner", c_void_p), ("path", c_char_p), ("scene_text", c_char_p), ("program", c_char_p), ("network_hash", c_uint64)], {})
complete(OmRecorderDef, [("cookie", c_uint32), ("out_dir", c_char_p), ("scene", POINTER(OmScene)), ("world", POINTER(OmWorld)), ("twin", c_void_p), ("planner", c_void_p), ("truth", c_void_p), ("frame_every", c_int), ("records_acquisitions", c_bool), ("has_recording", c_bool)], {})
complete(OmReplayDef, [("cookie", c_uint32), ("dir", c_char_p), ("path", c_char_p), ("engines", POINTER(OmEngineSet)), ("nworker", c_int)], {})
complete(OmReplayResult, [("is_same", c_bool), ("nline", c_int), ("ndecision", c_int), ("time", c_double), ("line", c_int), ("was", c_char_p), ("now", c_char_p), ("reason", c_char * 1024)], {})
complete(OmFemGrid, [("grid", OmGrid), ("npoint", c_int), ("mesh", OmFemMesh), ("cell_elem", c_void_p), ("point_node", c_void_p), ("node_point", c_void_p), ("fixed", c_void_p)], {})
complete(OmFemGridPatch, [("num", c_int), ("factor", c_void_p), ("column", POINTER(c_void_p)), ("dof", c_void_p)], {})
complete(OmFemGridStop, [("tolerance", c_double), ("max_cycle", c_int), ("nworker", c_int)], {})
complete(OmFemGridReport, [("ncycle", c_int), ("left", c_double), ("min_volume", c_double)], {})
complete(OmFemGridUntangling, [("ninverted", c_int), ("nmoved", c_int), ("max", c_double), ("mean", c_double), ("min_volume", c_double)], {})
complete(OmSpring, [("vert", c_int), ("stiffness", c_double), ("length", c_double)], {})
complete(OmChainDef, [("stretch", c_double), ("compress", c_double), ("shear", c_double), ("relaxation", c_double), ("sweeps", c_int), ("cookie", c_uint32)], {})
complete(OmMeshFrame, [("unit", c_double), ("space", c_int)], {"space": OmSpace})
complete(OmSurfaceCheck, [("nopen_edge", c_int), ("nmanifold_edge", c_int), ("nflipped_edge", c_int), ("ncomponent", c_int), ("neuler", c_int), ("first_edge", c_int * 2), ("first_tri", c_int)], {})
complete(OmMeshArray, [("name", c_char_p), ("type", c_int), ("ncomp", c_int), ("is_cell", c_bool), ("value", c_void_p)], {"type": OmArrayType})
complete(OmRecordingArrays, [("array", POINTER(OmMeshArray)), ("narray", c_int)], {})
complete(OmRecordedSurface, [("name", c_char_p), ("surface", POINTER(OmSurface))], {})
complete(OmAcquisitionFile, [("path", c_char * 512), ("cloud", c_char * 512), ("series", c_char * 512), ("frame_index", c_int), ("grasp_frame", c_int * 2), ("frame", OmMeshFrame), ("registered", c_int), ("time", c_double), ("noise", c_double), ("has_camera", c_bool), ("camera", OmCamera), ("ngrasp", c_int), ("grasp", OmMatchGrasp * 2)], {})
complete(OmRegisterDef, [("cookie", c_uint32), ("has_start", c_bool), ("pose_model_scan", OmPose), ("start_angle", c_double), ("start_shift", c_double), ("npoint", c_int), ("min_overlap", c_double), ("max_residual", c_double), ("max_sigma_angle", c_double), ("max_sigma_shift", c_double), ("nworker", c_int)], {})
complete(OmRegistration, [("pose_model_scan", OmPose), ("residual", c_double), ("overlap", c_double), ("sigma_angle", c_double), ("sigma_shift", c_double), ("axis_angle", OmVec3), ("axis_shift", OmVec3), ("center", OmVec3), ("is_reliable", c_bool), ("reason", c_char * 256), ("nstart", c_int), ("niteration", c_int), ("ms", c_double)], {})
complete(OmMatchReport, [("title", c_char_p), ("site", POINTER(OmSite)), ("match", c_void_p), ("nacquisition", c_int), ("acquisition", POINTER(OmAcquisition)), ("name", POINTER(c_char_p)), ("registration", POINTER(OmRegistration)), ("estimate", POINTER(OmMatchEstimate)), ("reason", c_char_p), ("load_ms", c_double), ("build_ms", c_double), ("register_ms", c_double)], {})
complete(OmPointCloud, [("npoint", c_int), ("ntri", c_int), ("x", c_void_p), ("normal", c_void_p), ("tri_vert", c_void_p), ("nduplicate", c_int), ("ndropped", c_int)], {})
complete(OmScanFileDef, [("cookie", c_uint32), ("frame", OmMeshFrame), ("pose_world_file", OmPose), ("has_eye", c_bool), ("eye", OmVec3), ("up", OmVec3), ("spacing", c_double), ("noise", c_double)], {})
complete(OmScanFileReport, [("npoint", c_int), ("nduplicate", c_int), ("ndropped", c_int), ("nestimated", c_int), ("nthinned", c_int)], {})
complete(OmScanFit, [("ratio", c_double), ("gap", c_double)], {})
complete(OmCsr, [("n", c_int), ("row_adr", c_void_p), ("col", c_void_p), ("value", c_void_p)], {})
complete(OmEigenDef, [("npair", c_int), ("shift", c_double), ("tolerance", c_double), ("max_restarts", c_int), ("nbasis", c_int), ("cookie", c_uint32)], {})
complete(OmEigenInfo, [("npair", c_int), ("nsolve", c_int), ("residual", c_double)], {})
complete(OmLaplacian, [("stiffness", OmCsr), ("area", c_void_p), ("total_area", c_double), ("nflip", c_int), ("added", c_double)], {})
complete(OmSpectralBasis, [("nvert", c_int), ("nrow", c_int), ("npair", c_int), ("vert", c_void_p), ("row", c_void_p), ("area", c_void_p), ("total_area", c_double), ("eigenvalue", c_void_p), ("phi", c_void_p), ("seconds", c_double)], {})
complete(OmSpectralDef, [("first", c_int), ("last", c_int), ("step", c_int), ("is_partial", c_bool), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmSpectralReport, [("nround", c_int), ("npair_a", c_int), ("npair_b", c_int), ("orthogonality", c_double), ("seconds", c_double)], {})
complete(OmTextPair, [("key", c_char_p), ("value", c_char_p)], {})
complete(OmFacts, [("n", c_int), ("pair", OmTextPair * 24)], {})
complete(OmTensor, [("name", c_char_p), ("type", c_int), ("rank", c_int), ("dim", c_int64 * 8), ("data", c_void_p)], {"type": OmTensorType})
complete(OmStoreField, [("name", c_char_p), ("unit", c_char_p), ("offset", c_size_t), ("type", c_int), ("n", c_int)], {"type": OmStoreType})
complete(OmPbdDef, [("kind", c_int), ("substeps", c_int), ("iterations", c_int), ("damping", c_double), ("max_speed", c_double), ("particle_volume", c_double), ("cluster_spacing", c_double), ("cluster_radius", c_double), ("cluster_stiffness", c_double), ("linear_stretch", c_double), ("internal_friction", c_double), ("edge_stiffness", c_double), ("volume_stiffness", c_double), ("collision_distance", c_double), ("recover_speed", c_double), ("friction", c_double), ("particle_friction", c_double), ("has_self_collision", c_bool), ("cookie", c_uint32)], {"kind": OmPbdKind})
complete(OmReport, [("html", OmText), ("status", c_int), ("message", c_char * 256), ("is_in_section", c_bool), ("is_in_grid", c_bool), ("is_in_fold", c_bool), ("nchart", c_int)], {"status": OmStatus})
complete(OmReportSeries, [("name", c_char_p), ("x", c_void_p), ("y", c_void_p), ("n", c_int), ("is_step", c_bool)], {})
complete(OmReportSpan, [("label", c_char_p), ("begin", c_double), ("end", c_double), ("is_bad", c_bool)], {})
complete(OmReportBox, [("min", c_double), ("lower", c_double), ("median", c_double), ("upper", c_double), ("max", c_double), ("n", c_int)], {})
complete(OmReportChart, [("title", c_char_p), ("x_label", c_char_p), ("y_label", c_char_p), ("series", OmReportSeries * 6), ("nseries", c_int), ("has_limit", c_bool), ("limit", c_double), ("limit_name", c_char_p), ("limit2", c_double), ("limit2_name", c_char_p), ("is_log_x", c_bool), ("is_log_y", c_bool), ("has_range", c_bool), ("y_min", c_double), ("y_max", c_double), ("event", c_void_p), ("nevent", c_int), ("span", POINTER(OmReportSpan)), ("nspan", c_int), ("ngroup", c_int), ("group", POINTER(c_char_p)), ("box", POINTER(OmReportBox))], {})
complete(OmRlKey, [("key", c_int), ("component", c_int), ("choice", c_int), ("about", c_char_p)], {})
complete(OmRlTaskOps, [("destroy", CFUNCTYPE(None, POINTER(OmRlTask))), ("state_create", CFUNCTYPE(c_int, POINTER(OmRlTask), POINTER(c_void_p))), ("state_destroy", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p)), ("reset", CFUNCTYPE(c_int, POINTER(OmRlTask), c_void_p, OmRng, c_int)), ("step", CFUNCTYPE(c_int, POINTER(OmRlTask), c_void_p, c_void_p, c_void_p, c_void_p)), ("observe", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, c_void_p)), ("info", CFUNCTYPE(c_int, POINTER(OmRlTask), c_void_p, c_void_p)), ("render", CFUNCTYPE(c_int, POINTER(OmRlTask), c_void_p, POINTER(OmPicture))), ("expert", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, POINTER(OmRng), c_void_p)), ("tip", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, c_void_p)), ("place", CFUNCTYPE(c_int, POINTER(OmRlTask), c_void_p, c_void_p)), ("steer", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, c_void_p, c_bool, c_void_p)), ("state_size", CFUNCTYPE(c_size_t, POINTER(OmRlTask))), ("save", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, c_void_p)), ("restore", CFUNCTYPE(None, POINTER(OmRlTask), c_void_p, c_void_p))], {})
complete(OmRlTask, [("ops", POINTER(OmRlTaskOps)), ("name", c_char * 32), ("nobservation", c_int), ("picture_width", c_int), ("picture_height", c_int), ("naction", c_int), ("nchoice", c_int * 8), ("max_step", c_int), ("nstart", c_int), ("ninfo", c_int), ("info_name", c_char_p * 8), ("score_name", c_char_p), ("target", c_double), ("key", POINTER(OmRlKey)), ("nkey", c_int), ("rest", c_int * 8), ("period", c_double), ("move", c_double), ("has_jaw", c_bool), ("meaning", c_char * 160), ("hash", c_uint64)], {})
complete(OmRlSetting, [("key", c_char_p), ("value", c_char_p)], {})
complete(OmRlTaskKind, [("name", c_char_p), ("about", c_char_p), ("create", CFUNCTYPE(c_int, POINTER(OmRlSetting), c_int, POINTER(POINTER(OmRlTask))))], {})
complete(OmRlVecDef, [("cookie", c_uint32), ("task", POINTER(OmRlTask)), ("nenv", c_int), ("nworker", c_int), ("seed", c_uint64), ("has_info", c_bool), ("has_autoreset", c_bool)], {})
complete(OmRlStep, [("obs", c_void_p), ("reward", c_void_p), ("is_terminated", c_void_p), ("is_truncated", c_void_p), ("final_obs", c_void_p), ("final_info", c_void_p), ("final_return", c_void_p), ("final_length", c_void_p)], {})
complete(OmRlDemos, [("task", c_char * 32), ("meaning", c_char * 160), ("nobservation", c_int), ("naction", c_int), ("nchoice", c_int * 8), ("ndemo", c_int), ("nstep", c_int), ("adr", c_void_p), ("obs", c_void_p), ("action", c_void_p), ("reward", c_void_p), ("score", c_void_p)], {})
complete(OmRlDriveNow, [("episode", c_int), ("nstep", c_int), ("sum", c_double), ("is_over", c_bool), ("is_terminated", c_bool)], {})
complete(OmRlPolicyDef, [("cookie", c_uint32), ("task", c_char * 32), ("nobservation", c_int), ("naction", c_int), ("nchoice", c_int * 8), ("nlayer", c_int), ("width", c_int), ("activation", c_int), ("picture_width", c_int), ("picture_height", c_int), ("seed", c_uint64)], {"activation": OmActivation})
complete(OmRlEval, [("nepisode", c_int), ("ret", c_void_p), ("score", c_void_p), ("length", c_void_p), ("is_ended", c_void_p), ("info", c_void_p), ("mean_return", c_double), ("mean_score", c_double), ("min_score", c_double), ("mean_length", c_double)], {})
complete(OmRlEvalDef, [("cookie", c_uint32), ("task", POINTER(OmRlTask)), ("policy", c_void_p), ("nepisode", c_int), ("is_drawn", c_bool), ("is_random", c_bool), ("is_expert", c_bool), ("nworker", c_int), ("seed", c_uint64)], {})
complete(OmRlKidney, [("center", OmVec3), ("half", OmVec3), ("bend", c_double)], {})
complete(OmRlRetractDef, [("tissue", c_int), ("thickness", c_double), ("cluster_spacing", c_double), ("cluster_radius", c_double), ("cluster_stiffness", c_double), ("has_self_collision", c_bool), ("young", c_double), ("poisson", c_double), ("density", c_double), ("kidney", OmRlKidney), ("kidney_file", c_char_p), ("kidney_label", c_int), ("kidney_shift", OmVec3), ("tumour_x", c_double), ("tumour_y", c_double), ("tumour_radius", c_double), ("target", OmVec3), ("workspace_lo", OmVec3), ("workspace_hi", OmVec3), ("instrument", c_int), ("instrument_file", c_char_p), ("endoscope", OmCamera), ("picture_width", c_int), ("picture_height", c_int), ("goal_along", c_double), ("max_step", c_int), ("hold", c_int), ("has_fixed_horizon", c_bool), ("still", c_int), ("repeat", c_int), ("has_gripper", c_bool), ("move", c_double), ("time_step", c_double), ("grasp_radius", c_double), ("reach", c_double), ("start_height", c_double), ("reward", c_int), ("step_cost", c_double), ("margin", c_double), ("npoint", c_int), ("has_picture", c_bool), ("is_awake", c_bool), ("tip_error", c_double), ("camera_noise", c_double), ("slip_force", c_double), ("nvariant", c_int), ("vary_thickness", c_double), ("vary_softness", c_double), ("vary_kidney", c_double), ("cookie", c_uint32)], {"tissue": OmRlTissue, "instrument": OmInstrument, "reward": OmRlReward})
complete(OmRlSurvey, [("along", c_double * 7), ("across", c_double * 7), ("exposure", (c_double * 7) * 7)], {})
complete(OmRlTrace, [("name", c_char * 256), ("n", c_int), ("has_jaw", c_bool), ("time", c_void_p), ("tip", c_void_p), ("jaw", c_void_p), ("line", c_void_p)], {})
complete(OmRlFollow, [("deviation", c_double), ("score", c_double), ("nstep", c_int), ("is_terminated", c_bool)], {})
complete(OmRlTrainRow, [("step", c_int64), ("nepisode", c_int64), ("mean_return", c_double), ("mean_length", c_double), ("mean_score", c_double), ("loss_policy", c_double), ("loss_value", c_double), ("entropy", c_double), ("divergence", c_double), ("clip_fraction", c_double), ("rate", c_double), ("right_demo", c_double), ("right_policy", c_double), ("eval_score", c_double), ("eval_return", c_double), ("eval_least", c_double), ("seconds", c_double)], {})
complete(OmRlTrainDef, [("cookie", c_uint32), ("task", POINTER(OmRlTask)), ("out_dir", c_char_p), ("method", c_int), ("nstep", c_int64), ("nenv", c_int), ("nworker", c_int), ("seed", c_uint64), ("policy", OmRlPolicyDef), ("start", c_char_p), ("horizon", c_int), ("batch", c_int), ("nepoch", c_int), ("rate", c_double), ("gamma", c_double), ("lambda_", c_double), ("clip", c_double), ("clip_value", c_double), ("entropy", c_double), ("sharpness", c_double), ("value", c_double), ("max_norm", c_double), ("normalise_advantage", c_bool), ("normalise_reward", c_bool), ("demos", c_char_p), ("weight_reward", c_double), ("weight_gail", c_double), ("clone_epoch", c_int), ("clone_rate", c_double), ("gail_rate", c_double), ("gail_noise", c_double), ("gail_epoch", c_int), ("gail_actions", c_bool), ("eval_period", c_int), ("eval_nepisode", c_int), ("eval_seed", c_uint64), ("eval_stop", c_int), ("eval_task", POINTER(OmRlTask)), ("checkpoint_period", c_double), ("command", c_char_p), ("on_row", CFUNCTYPE(None, c_void_p, POINTER(OmRlTrainRow))), ("ctx", c_void_p)], {"method": OmRlMethod})
complete(OmRlTrainResult, [("policy", c_void_p), ("row", POINTER(OmRlTrainRow)), ("nrow", c_int), ("is_resumed", c_bool), ("kept_step", c_int64), ("seconds", c_double)], {})
complete(OmCtDef, [("cookie", c_uint32), ("seed", c_uint64), ("voxel", c_double), ("organ_half", c_double), ("fat_half", c_double), ("fat_thickness", c_double), ("fat_ripple", c_double), ("tumour_shift", c_double * 2), ("tumour_radius", c_double), ("tumour_height", c_double), ("blur", c_double), ("noise", c_double)], {})
complete(OmStuffDef, [("cookie", c_uint32), ("edge", c_double), ("fn", OmShapeFn), ("ctx", c_void_p), ("lo", OmVec3), ("hi", OmVec3), ("level", c_double), ("max_tet", c_int), ("nworker", c_int)], {})
complete(OmMeshQuality, [("nvert", c_int), ("ntet", c_int), ("nboundary_tri", c_int), ("volume", c_double), ("dihedral_min", c_double), ("dihedral_max", c_double), ("dihedral_bin", c_int64 * 18), ("edge_min", c_double), ("edge_mean", c_double), ("edge_max", c_double), ("npart", c_int), ("euler", c_int), ("nlayer", c_int), ("is_manifold", c_bool)], {})
complete(OmPatchDef, [("cookie", c_uint32), ("share", c_double), ("seed", c_uint64), ("center", c_int), ("w_d", c_double * 2), ("w_n", c_double * 2), ("w_p", c_double * 2), ("noise_length", c_double)], {})
complete(OmPatientMaterial, [("name", c_char * 64), ("label", c_int), ("young", c_double), ("poisson", c_double), ("density", c_double)], {})
complete(OmPatient, [("name", c_char * 64), ("mesh", OmTetMesh), ("material", OmPatientMaterial * 16), ("nmaterial", c_int), ("organ", OmSurface), ("organ_spacing", c_double), ("roi_point", c_void_p), ("roi_normal", c_void_p), ("nroi", c_int), ("roi_center", OmVec3), ("roi_radius", c_double), ("up", OmVec3), ("file_space", c_int)], {"file_space": OmSpace})
complete(OmAttachDef, [("face", c_char * 16), ("direction", c_char * 64), ("share", c_double), ("seed", c_uint64), ("turn", c_double)], {})
complete(OmSheetDef, [("thickness", c_double), ("bridge", c_double), ("gap", c_double), ("side", c_char * 64), ("half_length", c_double), ("half_width", c_double), ("corner", c_double), ("wrap", c_double), ("attach", OmAttachDef * 8), ("nattach", c_int), ("tumour_radius", c_double), ("tumour_height", c_double), ("tumour_shift", c_double * 2), ("nroi", c_int)], {})
complete(OmOverDef, [("label", c_int * 64), ("nlabel", c_int), ("roi", c_int), ("side", c_char * 64), ("reach", c_double), ("attach", OmAttachDef * 8), ("nattach", c_int), ("nroi", c_int)], {})
complete(OmModelDef, [("cookie", c_uint32), ("input", c_char * 1024), ("name", c_char * 64), ("volume", c_int), ("label", c_int * 64), ("nlabel", c_int), ("label_name", (c_char * 128) * 64), ("nlabel_name", c_int), ("all_labels", c_bool), ("max_volume_size", c_uint64), ("has_window", c_bool), ("window_lo", c_double), ("window_hi", c_double), ("part", c_int * 16), ("npart", c_int), ("keep_all", c_bool), ("min_share", c_double), ("connectivity", c_int), ("keep_holes", c_bool), ("close_radius", c_double), ("smooth", c_double), ("edge", c_double), ("unit", c_double), ("space", c_int), ("remesh", c_bool), ("refine", c_bool), ("material", OmPatientMaterial * 16), ("nmaterial", c_int), ("sheet", OmSheetDef), ("over", OmOverDef), ("nworker", c_int)], {"space": OmSpace})
complete(OmModelReport, [("quality", OmMeshQuality), ("selected", c_char * 256), ("nvoxel", c_int64), ("voxel", OmVec3), ("label_volume", c_double), ("label_error", c_double), ("part_volume", c_double * 16), ("part_is_kept", c_bool * 16), ("left_out", c_double), ("filled", c_double), ("mask_volume", c_double), ("mesh_volume", c_double), ("surface_volume", c_double), ("volume_error", c_double), ("surface_error_mean", c_double), ("surface_error_max", c_double), ("surface_error_voxel", c_double), ("level_shift", c_double), ("edge", c_double), ("npart_mask", c_int), ("npart_kept", c_int), ("ncapped", c_int), ("seconds", c_double), ("note", c_char * 1024), ("warning", c_char * 512)], {})
complete(OmLabelRow, [("name", c_char * 128), ("label", c_int), ("value", c_int), ("layer", c_int), ("nvoxel", c_int64), ("volume", c_double), ("npart", c_int), ("largest", c_double), ("is_cut", c_bool), ("lo", OmVec3), ("hi", OmVec3), ("centroid", OmVec3)], {})
complete(OmLabelList, [("dim", c_int * 3), ("voxel", OmVec3), ("nentry", c_int), ("has_layers", c_bool), ("is_intensity", c_bool), ("min", c_double), ("max", c_double), ("nempty", c_int), ("nrow", c_int), ("row", POINTER(OmLabelRow))], {})
complete(OmYamlField, [("key", c_char_p), ("kind", c_int), ("offset", c_size_t), ("min", c_double), ("max", c_double), ("scale", c_double), ("size", c_size_t), ("sub", POINTER(OmYamlSchema)), ("name", POINTER(c_char_p)), ("count_offset", c_size_t), ("capacity", c_int), ("has_lines", c_bool), ("is_required", c_bool), ("group", c_uint), ("unit", c_char_p), ("help", c_char_p)], {"kind": OmYamlKind})
complete(OmYamlSchema, [("title", c_char_p), ("field", POINTER(OmYamlField)), ("nfield", c_int), ("set_default", CFUNCTYPE(None, c_void_p)), ("renamed", POINTER(c_char_p)), ("line_offset", c_size_t)], {})
complete(OmYamlPrint, [("group", c_uint), ("is_commented", c_bool), ("shows_others", c_bool)], {})
complete(OmStereoPair, [("left", OmCamera), ("right", OmCamera), ("left_picture", POINTER(OmPicture)), ("right_picture", POINTER(OmPicture))], {})
complete(OmStereoDef, [("cookie", c_uint32), ("near_m", c_double), ("far_m", c_double), ("penalty_one", c_int), ("penalty_jump", c_int), ("min_gain", c_double), ("max_twist", c_double), ("min_patch", c_int), ("is_refined", c_bool), ("nworker", c_int)], {})
complete(OmStereoReport, [("share", c_double), ("ndisparity", c_int), ("baseline", c_double), ("focal", c_double), ("ms_rectify", c_double), ("ms_match", c_double), ("ms_refine", c_double), ("ms_total", c_double)], {})
complete(OmSurfacePoint, [("tri", c_int), ("bary", c_double * 3), ("x", OmVec3), ("distance", c_double)], {})
complete(OmUmeshGrid, [("fem", OmFemGrid), ("up", OmVec3), ("is_surface", c_void_p), ("surface_x", c_void_p), ("hash", c_uint64)], {})
complete(OmUmeshPatch, [("center", OmVec3), ("normal", OmVec3), ("along", OmVec3), ("size", c_double * 3)], {})
complete(OmUmeshOrganDef, [("patient", POINTER(OmPatient)), ("surface", POINTER(OmSurface)), ("up", OmVec3), ("nelem", c_int), ("spacing", c_double), ("dim", c_int * 3), ("multiple", c_int), ("min_fill", c_double), ("held_height", c_double), ("cookie", c_uint32)], {})
complete(OmUmeshDataDef, [("organ", c_void_p), ("out_dir", c_char_p), ("nsample", c_int), ("seed", c_uint64), ("material", OmMaterial), ("max_force", c_double), ("max_tilt", c_double), ("press_share", c_double), ("max_press", c_double), ("pull_share", c_double), ("patch_size", c_double * 3), ("min_patch", c_int), ("tolerance", c_double), ("min_volume", c_double), ("max_attempt", c_int), ("shard", c_int), ("npicture", c_int), ("nworker", c_int), ("cookie", c_uint32)], {})
complete(OmUmeshSample, [("patch", OmUmeshPatch), ("force", OmVec3), ("direction", OmVec3), ("tilt", c_double), ("press", c_double), ("npatch", c_int), ("nattempt", c_int), ("nfail", c_int), ("nnewton", c_int), ("residual", c_double), ("min_volume", c_double), ("max_u", c_double), ("seconds", c_double)], {})
complete(OmUmeshSummary, [("nsample", c_int), ("nmade", c_int), ("nattempt", c_int), ("nfail", c_int), ("max_u", c_double), ("mean_u", c_double), ("max_force", c_double), ("seconds", c_double), ("solve_seconds", c_double)], {})
complete(OmUmeshData, [("grid", OmUmeshGrid), ("nsample", c_int), ("seed", c_uint64), ("hash", c_uint64), ("sample", POINTER(OmUmeshSample)), ("mask", c_void_p), ("u", c_void_p)], {})
complete(OmUmeshTrust, [("score", c_double), ("way", c_double), ("stretch", c_double), ("rough", c_double), ("size", c_double), ("angle", c_double), ("is_inside", c_bool), ("why", c_char * 128)], {})
complete(OmUmeshTrainDef, [("data", POINTER(OmUmeshData)), ("out_dir", c_char_p), ("command", c_char_p), ("nvalid", c_int), ("base_channels", c_int), ("nlevel", c_int), ("type", c_int), ("batch", c_int), ("nepoch", c_int), ("poisson", c_double), ("rate", c_double), ("seed", c_uint64), ("nworker", c_int), ("cookie", c_uint32)], {"type": OmNetType})
complete(OmUmeshTrainSummary, [("valid_error", c_double), ("linear_error", c_double), ("best_epoch", c_int), ("nepoch", c_int), ("nstep", c_int64), ("seconds", c_double), ("is_resumed", c_bool)], {})
complete(OmUmeshEval, [("n", c_int), ("mean", c_double), ("sd", c_double), ("worst", c_double), ("worst_sample", c_int), ("network_mean", c_double), ("network_worst", c_double), ("alone_mean", c_double), ("alone_worst", c_double), ("linear_mean", c_double), ("linear_worst", c_double), ("linear_ms", c_double), ("mean_cycle", c_double), ("max_cycle", c_int), ("ninverted", c_int), ("nbeyond", c_int), ("max_u", c_double), ("ms_median", c_double), ("ms_min", c_double), ("ms_max", c_double), ("ninside", c_int), ("error", c_void_p), ("score", c_void_p)], {})
complete(OmWorldLogInfo, [("narm", c_int), ("sources", c_uint), ("size", c_int64), ("nadvance", c_int), ("nobserve", c_int), ("npicture", c_int), ("time", c_double), ("is_complete", c_bool)], {})
complete(OmSeriesFrame, [("time", c_double), ("pose_world_camera", OmPose), ("color", c_char * 128), ("depth", c_char * 128), ("right", c_char * 128), ("narm", c_int), ("arm", OmArmObservation * 2)], {})
complete(OmSeries, [("dir", c_char * 512), ("camera", OmCamera), ("has_right", c_bool), ("right", OmCamera), ("depth_unit", c_double), ("nframe", c_int), ("capacity", c_int), ("frame", POINTER(OmSeriesFrame))], {})

# ---- functions: name, type of the result, types of the arguments

PROTOTYPES: dict[str, tuple[Any, list[Any]]] = {
    "om_acquisition_done": (None, [POINTER(OmAcquisition)]),
    "om_acquisition_load": (c_int, [c_char_p, POINTER(OmSite), POINTER(OmAcquisitionFile), POINTER(OmAcquisition)]),
    "om_acquisition_move": (None, [POINTER(OmAcquisition), OmPose]),
    "om_acquisition_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmAcquisitionFile)]),
    "om_acquisition_print_example": (c_int, [POINTER(OmText)]),
    "om_acquisition_save": (c_int, [POINTER(OmAcquisition), c_char_p]),
    "om_action_outcome_text": (c_char_p, [c_int]),
    "om_activation_name": (c_char_p, [c_int]),
    "om_ahead_create": (c_int, [POINTER(OmAheadDef), c_void_p, POINTER(c_void_p)]),
    "om_ahead_default_def": (OmAheadDef, [POINTER(OmScene), POINTER(OmSite)]),
    "om_ahead_destroy": (None, [c_void_p]),
    "om_alloc": (c_void_p, [c_size_t, c_size_t]),
    "om_alloc_alive": (c_int64, []),
    "om_alloc_count": (c_int64, []),
    "om_allocator_set": (None, [POINTER(OmAllocator)]),
    "om_arena_create": (c_int, [c_size_t, POINTER(OmArena)]),
    "om_arena_destroy": (None, [POINTER(OmArena)]),
    "om_arena_push": (c_void_p, [POINTER(OmArena), c_size_t, c_size_t]),
    "om_arm_is_empty": (c_bool, [POINTER(OmArmObservation)]),
    "om_arm_is_holding": (c_bool, [POINTER(OmArmObservation)]),
    "om_assert_failed": (None, [c_char_p, c_char_p, c_int]),
    "om_audit_create": (c_int, [POINTER(OmAuditDef), POINTER(c_void_p)]),
    "om_audit_default_def": (OmAuditDef, [c_void_p]),
    "om_audit_destroy": (None, [c_void_p]),
    "om_audit_listener": (OmLoopListener, [c_void_p]),
    "om_audit_story": (c_char_p, [c_void_p]),
    "om_audit_text": (c_char_p, [c_void_p]),
    "om_banet_advice_done": (None, [POINTER(OmBanetAdvice)]),
    "om_banet_advice_intersect": (c_int, [POINTER(OmBanetAdvice), c_double, c_void_p]),
    "om_banet_cell_turn": (c_bool, [c_void_p, c_void_p, c_void_p, c_int, c_void_p, c_void_p]),
    "om_banet_cells_done": (None, [POINTER(OmBanetCells)]),
    "om_banet_cells_expand": (c_int, [POINTER(OmBanetCells), c_void_p, c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_banet_cells_make": (c_int, [POINTER(OmBanetSample), c_double, POINTER(OmBanetCells)]),
    "om_banet_data_default_def": (OmBanetDataDef, [c_uint64, c_char_p]),
    "om_banet_data_done": (None, [POINTER(OmBanetData)]),
    "om_banet_data_join": (c_int, [POINTER(OmBanetData), POINTER(OmBanetData)]),
    "om_banet_data_load": (c_int, [c_char_p, c_int, POINTER(OmBanetData)]),
    "om_banet_data_test_def": (OmBanetDataDef, [c_int, c_char_p]),
    "om_banet_default_side": (c_double, [POINTER(OmSurface)]),
    "om_banet_estimate": (c_int, [c_void_p, c_double, POINTER(OmSurface), c_void_p, c_void_p, c_void_p]),
    "om_banet_eval": (c_int, [c_void_p, POINTER(OmBanetData), c_int, c_int, c_int, POINTER(OmProgress), POINTER(OmBanetEval)]),
    "om_banet_eval_done": (None, [POINTER(OmBanetEval)]),
    "om_banet_find_cells": (None, [POINTER(OmBanetGrid), POINTER(OmSurface), c_void_p]),
    "om_banet_fuse": (c_int, [POINTER(OmBanetFuseDef), c_int, POINTER(OmBanetView), c_int, c_void_p]),
    "om_banet_fuse_default_def": (OmBanetFuseDef, []),
    "om_banet_generate": (c_int, [POINTER(OmBanetDataDef), POINTER(OmProgress), POINTER(OmBanetSummary)]),
    "om_banet_grid_fit": (c_int, [POINTER(OmSurface), c_double, POINTER(OmBanetGrid)]),
    "om_banet_grid_local": (OmVec3, [POINTER(OmBanetGrid), OmVec3]),
    "om_banet_intersect": (c_int, [c_int, POINTER(OmBanetView), c_int, c_double, c_int, c_void_p]),
    "om_banet_intersect_grasps": (c_int, [c_int, POINTER(OmBanetView), c_double, c_int, c_void_p]),
    "om_banet_measure": (None, [POINTER(OmMatchView), POINTER(OmMatchPairs), c_void_p, c_void_p]),
    "om_banet_net_destroy": (None, [c_void_p]),
    "om_banet_net_fact": (c_char_p, [c_void_p, c_char_p]),
    "om_banet_net_find": (c_int, [c_char_p, c_char_p, POINTER(c_void_p)]),
    "om_banet_net_hash": (c_uint64, [c_void_p]),
    "om_banet_net_load": (c_int, [c_char_p, POINTER(c_void_p)]),
    "om_banet_net_size": (c_size_t, [c_void_p]),
    "om_banet_net_threshold": (c_double, [c_void_p]),
    "om_banet_predict": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_banet_predictor_create": (c_int, [c_void_p, c_void_p, c_int, POINTER(c_void_p)]),
    "om_banet_predictor_destroy": (None, [c_void_p]),
    "om_banet_reliability": (c_int, [c_int64, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p]),
    "om_banet_sample_def_hash": (c_uint64, [POINTER(OmBanetSampleDef)]),
    "om_banet_sample_def_validate": (c_int, [POINTER(OmBanetSampleDef)]),
    "om_banet_sample_default_def": (OmBanetSampleDef, [c_uint64]),
    "om_banet_sample_done": (None, [POINTER(OmBanetSample)]),
    "om_banet_sample_make": (c_int, [POINTER(OmBanetSampleDef), c_int64, POINTER(OmBanetSample)]),
    "om_banet_test_name": (c_char_p, [c_int]),
    "om_banet_train": (c_int, [POINTER(OmBanetTrainDef), POINTER(OmProgress), POINTER(OmBanetTrainSummary)]),
    "om_banet_train_default_def": (OmBanetTrainDef, [POINTER(OmBanetData), c_char_p]),
    "om_banet_update": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmProgress), POINTER(OmMatchEstimate), POINTER(OmBanetAdvice)]),
    "om_banet_update_default_def": (OmBanetUpdateDef, [c_void_p]),
    "om_banet_updater_create": (c_int, [POINTER(OmBanetUpdateDef), POINTER(c_void_p)]),
    "om_banet_updater_destroy": (None, [c_void_p]),
    "om_banet_updater_set_attached": (None, [c_void_p, c_void_p]),
    "om_banet_voxelize": (c_int, [POINTER(OmBanetGrid), POINTER(OmSurface), c_void_p, c_void_p, c_void_p]),
    "om_banet_way_name": (c_char_p, [c_int]),
    "om_block_at": (c_int, [POINTER(OmSituation), c_int, c_int]),
    "om_body_attached": (c_void_p, [c_void_p]),
    "om_body_attachment_stiffness": (c_void_p, [c_void_p]),
    "om_body_create": (c_int, [POINTER(OmScene), POINTER(OmSite), c_int, POINTER(c_void_p)]),
    "om_body_create_shared": (c_int, [c_void_p, c_void_p, POINTER(c_void_p)]),
    "om_body_describe": (None, [POINTER(OmScene), POINTER(OmSite), c_char_p, c_size_t]),
    "om_body_destroy": (None, [c_void_p]),
    "om_body_engine": (POINTER(OmTissueEngine), [c_void_p]),
    "om_body_eval_anchor": (c_int, [c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_body_find_engine": (c_int, [POINTER(OmScene), c_int, POINTER(POINTER(OmTissueEngine))]),
    "om_body_find_mesh_factor": (c_int, [POINTER(OmSite), c_void_p]),
    "om_body_force": (c_void_p, [c_void_p]),
    "om_body_get_attachment_force": (c_int, [c_void_p, c_void_p]),
    "om_body_get_forces": (c_int, [c_void_p, POINTER(OmBodyForces)]),
    "om_body_get_measure": (c_int, [c_void_p, c_int, c_void_p]),
    "om_body_get_vertex_forces": (c_int, [c_void_p, c_void_p]),
    "om_body_grasp": (c_int, [c_void_p, c_int, OmPose, c_double, c_void_p]),
    "om_body_hash": (c_uint64, [c_void_p]),
    "om_body_held_by": (c_void_p, [c_void_p]),
    "om_body_is_holding": (c_bool, [c_void_p, c_int]),
    "om_body_make_tissue_def": (c_int, [POINTER(OmScene), POINTER(OmSite), POINTER(OmBodyParts), POINTER(OmTissueDef)]),
    "om_body_model_create": (c_int, [POINTER(OmScene), POINTER(OmSite), c_int, POINTER(c_void_p)]),
    "om_body_model_destroy": (None, [c_void_p]),
    "om_body_move": (c_int, [c_void_p, c_int, OmPose]),
    "om_body_nbad": (c_int, [c_void_p]),
    "om_body_release": (None, [c_void_p, c_int]),
    "om_body_reset": (None, [c_void_p]),
    "om_body_restore": (None, [c_void_p, c_void_p]),
    "om_body_save": (None, [c_void_p, c_void_p]),
    "om_body_set_attachment": (c_int, [c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_body_set_force": (c_int, [c_void_p, c_void_p]),
    "om_body_set_work": (None, [c_void_p, c_void_p]),
    "om_body_set_young": (c_int, [c_void_p, POINTER(OmScene), c_double]),
    "om_body_settle": (c_int, [c_void_p, c_double, c_double, c_double]),
    "om_body_site": (POINTER(OmSite), [c_void_p]),
    "om_body_state_size": (c_size_t, [c_void_p]),
    "om_body_step": (c_int, [c_void_p, c_double, POINTER(OmBodyReport)]),
    "om_body_step_many": (c_int, [c_int, POINTER(c_void_p), c_int, POINTER(c_void_p), c_double, c_void_p]),
    "om_body_work_create": (c_int, [c_void_p, POINTER(c_void_p)]),
    "om_body_work_destroy": (None, [c_void_p]),
    "om_body_x": (c_void_p, [c_void_p]),
    "om_bsr_apply": (None, [POINTER(OmBsr), c_int, c_void_p, c_void_p]),
    "om_bsr_create": (c_int, [c_int, c_int, c_int, c_void_p, POINTER(OmBsr)]),
    "om_bsr_destroy": (None, [POINTER(OmBsr)]),
    "om_bsr_find": (c_int, [POINTER(OmBsr), c_int, c_int]),
    "om_bsr_find_elements": (c_int, [POINTER(OmBsr), c_int, c_int, c_void_p, c_void_p]),
    "om_bsr_make_exact": (c_int, [POINTER(OmBsr)]),
    "om_bsr_zero": (None, [POINTER(OmBsr)]),
    "om_calibration_add_param": (None, [POINTER(OmCalibrationDef), c_char_p, c_double, c_double, c_double, c_bool]),
    "om_calibration_default_def": (OmCalibrationDef, [OmCalibrationFn, c_void_p, c_int]),
    "om_calibration_norm_eval": (c_double, [POINTER(OmCalibrationDef), c_int, c_void_p, c_void_p]),
    "om_calibration_path_run": (c_int, [c_void_p, c_void_p, c_int, c_void_p, c_void_p]),
    "om_calibration_problem_destroy": (None, [c_void_p]),
    "om_calibration_problem_input": (c_char_p, [c_void_p, c_int]),
    "om_calibration_problem_load": (c_int, [c_char_p, c_char_p, POINTER(c_void_p)]),
    "om_calibration_problem_npoint": (c_int, [c_void_p]),
    "om_calibration_problem_search": (OmCalibrationDef, [c_void_p]),
    "om_calibration_problem_seen": (POINTER(OmCalibrationSeen), [c_void_p, c_void_p]),
    "om_calibration_problem_start": (c_void_p, [c_void_p]),
    "om_calibration_result_done": (None, [POINTER(OmCalibrationResult)]),
    "om_calibration_run": (c_int, [POINTER(OmCalibrationDef), POINTER(OmProgress), POINTER(OmCalibrationResult)]),
    "om_calibration_run_points": (c_int, [c_void_p, c_void_p, c_int, c_void_p]),
    "om_calibration_save_synthetic": (c_int, [c_void_p, c_void_p, c_double, c_uint64, c_char_p]),
    "om_calibration_tissue_create": (c_int, [POINTER(OmCalibrationTissueDef), c_void_p, POINTER(c_void_p)]),
    "om_calibration_tissue_default_def": (OmCalibrationTissueDef, [OmCalibrationBuildFn, c_void_p]),
    "om_calibration_tissue_destroy": (None, [c_void_p]),
    "om_calibration_tissue_eval": (c_int, [c_void_p, c_void_p, c_int, c_void_p]),
    "om_calibration_tissue_search": (OmCalibrationDef, [c_void_p]),
    "om_calloc": (c_void_p, [c_size_t, c_size_t]),
    "om_camera_check": (c_int, [POINTER(OmCamera)]),
    "om_camera_lens": (OmLens, [POINTER(OmCamera)]),
    "om_camera_project": (c_bool, [POINTER(OmCamera), OmVec3, c_void_p, c_void_p]),
    "om_camera_ray": (OmVec3, [POINTER(OmCamera), c_double, c_double]),
    "om_camera_resize": (OmCamera, [POINTER(OmCamera), c_int, c_int]),
    "om_chain_default_def": (OmChainDef, []),
    "om_chain_engine": (POINTER(OmTissueEngine), []),
    "om_clock_now": (c_double, []),
    "om_cloud_default_def": (OmCloudDef, [POINTER(OmWorld), POINTER(OmSite)]),
    "om_cloud_done": (None, [POINTER(OmCloud)]),
    "om_cloud_field_eval": (c_int, [POINTER(OmCloudField), OmVec3]),
    "om_cloud_field_init": (c_int, [POINTER(OmCloudDef), POINTER(OmObservation), POINTER(OmCloudField)]),
    "om_cloud_init": (c_int, [POINTER(OmCloudDef), POINTER(OmObservation), POINTER(OmCloud)]),
    "om_contact_create": (c_int, [POINTER(OmContactDef), c_void_p, POINTER(c_void_p)]),
    "om_contact_default_def": (OmContactDef, []),
    "om_contact_destroy": (None, [c_void_p]),
    "om_contact_eval_distance": (c_double, [c_void_p, OmVec3]),
    "om_contact_get_obstacles": (c_int, [c_void_p, POINTER(POINTER(OmTissueObstacle))]),
    "om_contact_settle": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p, c_double, c_double, c_double]),
    "om_contact_step": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p, c_double, POINTER(OmContactReport)]),
    "om_contact_surface_make": (c_int, [POINTER(OmTetMesh), c_int, POINTER(OmSurface)]),
    "om_contact_work_create": (c_int, [c_void_p, POINTER(c_void_p)]),
    "om_contact_work_destroy": (None, [c_void_p]),
    "om_contact_work_move": (c_int, [c_void_p, c_int, OmPose, OmPose]),
    "om_contact_work_set_presses": (None, [c_void_p, c_int, POINTER(c_void_p)]),
    "om_csr_apply": (None, [POINTER(OmCsr), c_void_p, c_void_p]),
    "om_csr_done": (None, [POINTER(OmCsr)]),
    "om_csr_get": (c_double, [POINTER(OmCsr), c_int, c_int]),
    "om_csr_init": (c_int, [c_int, c_int, c_void_p, c_void_p, c_void_p, POINTER(OmCsr)]),
    "om_csr_init_diagonal": (c_int, [c_int, c_void_p, POINTER(OmCsr)]),
    "om_ct_default_def": (OmCtDef, [c_uint64]),
    "om_ct_get_dice": (c_double, [POINTER(OmVolume), POINTER(OmVolume), c_int]),
    "om_ct_label": (c_int, [POINTER(OmVolume), POINTER(OmVolume)]),
    "om_ct_label_text": (c_char_p, [c_int]),
    "om_ct_make": (c_int, [POINTER(OmCtDef), POINTER(OmVolume), POINTER(OmVolume)]),
    "om_depth_add_noise": (None, [POINTER(OmDepthNoise), POINTER(OmCamera), c_uint64, c_void_p, c_void_p]),
    "om_depth_noise_default": (OmDepthNoise, [c_uint64]),
    "om_depth_to_cloud": (c_int, [POINTER(OmCamera), c_void_p, c_void_p, c_void_p, c_int, c_void_p, c_void_p]),
    "om_eigen_default_def": (OmEigenDef, [c_int, c_double]),
    "om_eigen_smallest": (c_int, [POINTER(OmEigenDef), POINTER(OmCsr), POINTER(OmCsr), c_void_p, c_void_p, POINTER(OmEigenInfo)]),
    "om_element_name": (c_char_p, [c_int]),
    "om_embedding_done": (None, [POINTER(OmEmbedding)]),
    "om_embedding_eval": (None, [POINTER(OmEmbedding), c_void_p, c_void_p]),
    "om_engine_capabilities": (c_uint, [POINTER(OmTissueEngine)]),
    "om_engine_data": (c_void_p, [c_void_p]),
    "om_engine_def": (POINTER(OmTissueDef), [c_void_p]),
    "om_engine_end_step": (None, [c_void_p, c_double]),
    "om_engine_find_goal": (c_bool, [c_void_p, c_int, POINTER(OmVec3)]),
    "om_engine_find_spring": (c_bool, [c_void_p, c_int, POINTER(OmVec3), c_void_p]),
    "om_engine_get_number": (c_double, [POINTER(OmEngineInput), c_char_p, c_double]),
    "om_engine_material": (POINTER(OmMaterial), [c_void_p, c_int]),
    "om_engine_matrix": (POINTER(OmBsr), [c_void_p]),
    "om_engine_options": (c_void_p, [c_void_p]),
    "om_engine_restore_state": (None, [c_void_p, c_void_p]),
    "om_engine_rhs": (c_void_p, [c_void_p]),
    "om_engine_save_state": (None, [c_void_p, c_void_p]),
    "om_engine_set_add": (c_int, [POINTER(OmEngineSet), POINTER(OmTissueEngine)]),
    "om_engine_set_data": (None, [c_void_p, c_void_p]),
    "om_engine_set_default": (OmEngineSet, []),
    "om_engine_set_find": (c_int, [POINTER(OmEngineSet), c_char_p, POINTER(POINTER(OmTissueEngine))]),
    "om_engine_set_work_data": (None, [c_void_p, c_void_p]),
    "om_engine_state_data": (c_void_p, [c_void_p]),
    "om_engine_tool_force": (c_void_p, [c_void_p]),
    "om_engine_uses": (c_bool, [POINTER(OmTissueEngine), c_char_p]),
    "om_engine_v": (c_void_p, [c_void_p]),
    "om_engine_volume": (c_void_p, [c_void_p]),
    "om_engine_work_data": (c_void_p, [c_void_p]),
    "om_engine_x": (c_void_p, [c_void_p]),
    "om_error_message": (c_char_p, []),
    "om_facts_done": (None, [POINTER(OmFacts)]),
    "om_facts_find": (c_char_p, [POINTER(OmFacts), c_char_p]),
    "om_fem_add_mass": (None, [c_void_p, c_double, c_bool, POINTER(OmBsr)]),
    "om_fem_apply_mass": (None, [c_void_p, c_bool, c_void_p, c_void_p]),
    "om_fem_create": (c_int, [POINTER(OmFemDef), POINTER(c_void_p)]),
    "om_fem_default_def": (OmFemDef, [POINTER(OmFemMesh), c_int, POINTER(OmMaterial)]),
    "om_fem_destroy": (None, [c_void_p]),
    "om_fem_dynamic_default_def": (OmFemDynamicDef, [c_void_p]),
    "om_fem_dynamics_create": (c_int, [c_void_p, POINTER(OmFemDynamicDef), POINTER(c_void_p)]),
    "om_fem_dynamics_destroy": (None, [c_void_p]),
    "om_fem_engine": (POINTER(OmTissueEngine), []),
    "om_fem_eval_contact": (c_int, [c_void_p, c_void_p, c_int, POINTER(OmFemTouch), c_void_p]),
    "om_fem_eval_energy": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_fem_eval_force": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p]),
    "om_fem_eval_momentum": (c_double, [c_void_p, c_bool, POINTER(OmFemMotion), POINTER(OmVec3), POINTER(OmVec3)]),
    "om_fem_eval_stable_step": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p]),
    "om_fem_eval_stress": (c_int, [c_void_p, c_void_p, c_int, c_void_p, POINTER(OmMat3), POINTER(OmMat3)]),
    "om_fem_eval_tangent": (c_int, [c_void_p, c_void_p, POINTER(OmBsr)]),
    "om_fem_eval_volume": (c_double, [c_void_p, c_void_p, c_void_p]),
    "om_fem_faces_done": (None, [POINTER(OmFemFaces)]),
    "om_fem_grid_done": (None, [POINTER(OmFemGrid)]),
    "om_fem_grid_eval_residual": (c_int, [POINTER(OmFemGrid), c_double, c_int, c_void_p, c_void_p, c_void_p]),
    "om_fem_grid_from_sdf": (c_int, [POINTER(OmSdf), c_double, POINTER(OmFemGrid)]),
    "om_fem_grid_init": (c_int, [POINTER(OmGrid), c_void_p, POINTER(OmFemGrid)]),
    "om_fem_grid_linear_create": (c_int, [POINTER(OmFemGrid), c_void_p, c_double, c_int, POINTER(c_void_p)]),
    "om_fem_grid_linear_destroy": (None, [c_void_p]),
    "om_fem_grid_linear_eval": (c_int, [c_void_p, POINTER(OmFemGridPatch), c_void_p, c_int, c_void_p]),
    "om_fem_grid_linear_solve": (c_int, [c_void_p, c_void_p, c_void_p, c_int, c_void_p]),
    "om_fem_grid_make_tet_mesh": (c_int, [POINTER(OmFemGrid), POINTER(OmTetMesh)]),
    "om_fem_grid_model_create": (c_int, [POINTER(OmFemGrid), c_double, c_int, POINTER(c_void_p)]),
    "om_fem_grid_model_destroy": (None, [c_void_p]),
    "om_fem_grid_patch_done": (None, [POINTER(OmFemGridPatch)]),
    "om_fem_grid_patch_init": (c_int, [c_void_p, c_void_p, POINTER(OmFemGridPatch)]),
    "om_fem_grid_second_order": (None, [POINTER(OmFemGrid), c_double, c_double, c_void_p, c_void_p]),
    "om_fem_grid_solve": (c_int, [c_void_p, POINTER(OmFemGridPatch), c_void_p, POINTER(OmFemGridStop), c_void_p, POINTER(OmFemGridReport)]),
    "om_fem_grid_untangle": (c_int, [POINTER(OmFemGrid), c_double, c_void_p, c_void_p, POINTER(OmFemGridUntangling)]),
    "om_fem_grid_work_create": (c_int, [c_void_p, POINTER(c_void_p)]),
    "om_fem_grid_work_destroy": (None, [c_void_p]),
    "om_fem_grid_work_memory": (c_size_t, [c_void_p]),
    "om_fem_mass": (c_void_p, [c_void_p]),
    "om_fem_matrix_create": (c_int, [c_void_p, POINTER(OmBsr)]),
    "om_fem_mesh": (POINTER(OmFemMesh), [c_void_p]),
    "om_fem_mesh_boundary": (c_int, [POINTER(OmFemMesh), POINTER(OmFemFaces)]),
    "om_fem_mesh_box": (c_int, [c_int, OmVec3, OmVec3, c_void_p, POINTER(OmFemMesh)]),
    "om_fem_mesh_done": (None, [POINTER(OmFemMesh)]),
    "om_fem_mesh_embed": (c_int, [POINTER(OmFemMesh), c_int, c_void_p, c_void_p, c_void_p]),
    "om_fem_mesh_from_tet": (c_int, [POINTER(OmTetMesh), c_int, POINTER(OmFemMesh)]),
    "om_fem_mesh_join": (c_int, [POINTER(OmFemMesh), POINTER(OmFemMesh), POINTER(OmFemMesh)]),
    "om_fem_mesh_validate": (c_int, [POINTER(OmFemMesh)]),
    "om_fem_static_default_def": (OmFemStaticDef, [c_void_p]),
    "om_fem_static_solve": (c_int, [c_void_p, POINTER(OmFemLoad), POINTER(OmFemStaticDef), c_void_p, c_void_p, POINTER(OmFemReport)]),
    "om_fem_statics_create": (c_int, [c_void_p, POINTER(OmFemStaticDef), POINTER(c_void_p)]),
    "om_fem_statics_destroy": (None, [c_void_p]),
    "om_fem_statics_solve": (c_int, [c_void_p, POINTER(OmFemLoad), c_void_p, c_void_p, POINTER(OmFemReport)]),
    "om_fem_step": (c_int, [c_void_p, POINTER(OmFemLoad), c_double, POINTER(OmFemMotion), POINTER(OmFemReport)]),
    "om_field_obstacle": (OmTissueObstacle, [OmDistanceFn, c_void_p]),
    "om_file_abort": (None, [POINTER(OmAtomicFile)]),
    "om_file_begin": (c_int, [c_char_p, POINTER(OmAtomicFile)]),
    "om_file_check_ours": (c_int, [c_char_p, c_char_p]),
    "om_file_commit": (c_int, [POINTER(OmAtomicFile)]),
    "om_file_open": (c_int, [c_char_p, POINTER(c_void_p), c_void_p]),
    "om_file_read": (c_int, [c_char_p, c_size_t, POINTER(c_char_p), c_void_p]),
    "om_file_write": (c_int, [c_char_p, c_void_p, c_size_t]),
    "om_folder_begin": (c_int, [c_char_p, c_char_p, POINTER(OmFolder)]),
    "om_folder_check": (c_int, [c_char_p, c_char_p]),
    "om_folder_commit": (c_int, [POINTER(OmFolder)]),
    "om_folder_commit_beside": (c_int, [POINTER(OmFolder)]),
    "om_folder_end": (None, [POINTER(OmFolder)]),
    "om_folder_open": (c_int, [c_char_p, c_char_p, POINTER(OmFolder)]),
    "om_free": (None, [c_void_p]),
    "om_half_ellipsoid_eval": (c_double, [OmVec3, OmVec3]),
    "om_hash": (c_uint64, [c_void_p, c_size_t, c_uint64]),
    "om_heuristic_eval_excess": (c_double, [c_void_p, c_void_p]),
    "om_heuristic_springs": (c_int, [c_void_p, POINTER(c_void_p), POINTER(POINTER(OmSpring))]),
    "om_hold_text": (c_char_p, [c_int]),
    "om_integer_parse": (c_bool, [POINTER(c_char_p), c_char_p, c_void_p]),
    "om_job_cancel": (None, [c_void_p]),
    "om_job_is_finished": (c_bool, [c_void_p]),
    "om_job_join": (c_int, [c_void_p]),
    "om_job_progress": (c_double, [c_void_p]),
    "om_job_start": (c_int, [OmJobFn, c_void_p, POINTER(c_void_p)]),
    "om_json_begin": (OmJson, [POINTER(OmText)]),
    "om_json_bool": (None, [POINTER(OmJson), c_char_p, c_bool]),
    "om_json_close": (None, [POINTER(OmJson), c_char]),
    "om_json_end": (c_int, [POINTER(OmJson)]),
    "om_json_integer": (None, [POINTER(OmJson), c_char_p, c_int64]),
    "om_json_number": (None, [POINTER(OmJson), c_char_p, c_double]),
    "om_json_numbers": (None, [POINTER(OmJson), c_char_p, c_void_p, c_int]),
    "om_json_open": (None, [POINTER(OmJson), c_char_p, c_char]),
    "om_json_save": (c_int, [POINTER(OmJson), c_char_p]),
    "om_json_string": (None, [POINTER(OmJson), c_char_p, c_char_p]),
    "om_label_list_done": (None, [POINTER(OmLabelList)]),
    "om_label_list_load": (c_int, [c_char_p, c_int, POINTER(OmProgress), POINTER(OmLabelList)]),
    "om_laplacian_done": (None, [POINTER(OmLaplacian)]),
    "om_laplacian_init": (c_int, [c_int, c_void_p, c_int, c_void_p, POINTER(OmLaplacian)]),
    "om_laplacian_init_cloud": (c_int, [c_int, c_void_p, c_void_p, POINTER(OmLaplacian)]),
    "om_law_find": (c_int, [c_char_p, c_void_p]),
    "om_law_name": (c_char_p, [c_int]),
    "om_layer_kind_name": (c_char_p, [c_int]),
    "om_log_set_sink": (None, [OmLogSink, c_void_p]),
    "om_loop_action": (POINTER(OmPlanAction), [c_void_p]),
    "om_loop_command": (c_int, [c_void_p, POINTER(OmLoopCommand)]),
    "om_loop_command_parse": (c_int, [c_char_p, c_int, POINTER(OmLoopCommand)]),
    "om_loop_command_text": (c_char_p, [c_int]),
    "om_loop_create": (c_int, [POINTER(OmLoopDef), POINTER(c_void_p)]),
    "om_loop_default_def": (OmLoopDef, [POINTER(OmSceneTask), POINTER(OmWorld), c_void_p, c_void_p]),
    "om_loop_destroy": (None, [c_void_p]),
    "om_loop_force": (c_double, [c_void_p, c_int]),
    "om_loop_grid": (c_int, [c_void_p]),
    "om_loop_hold": (c_int, [c_void_p]),
    "om_loop_hold_reason": (c_char_p, [c_void_p]),
    "om_loop_is_paused": (c_bool, [c_void_p]),
    "om_loop_ntick": (c_int, [c_void_p]),
    "om_loop_phase": (c_int, [c_void_p]),
    "om_loop_plan": (POINTER(OmPlan), [c_void_p]),
    "om_loop_preplan": (POINTER(OmPreplan), [c_void_p]),
    "om_loop_result": (POINTER(OmRetractResult), [c_void_p]),
    "om_loop_sample": (OmRetractSample, [c_void_p]),
    "om_loop_take_result": (c_int, [c_void_p, POINTER(OmRetractResult)]),
    "om_loop_tick": (c_int, [c_void_p]),
    "om_loop_warning": (c_int, [c_void_p]),
    "om_loss": (OmLoss, [c_int]),
    "om_loss_eval": (c_int, [POINTER(OmLoss), c_int, OmNetShape, c_void_p, c_void_p, c_int, c_void_p, c_void_p]),
    "om_mask_choose_parts": (c_int, [POINTER(OmMask), c_int, c_void_p, c_int]),
    "om_mask_close": (c_int, [POINTER(OmMask), c_double]),
    "om_mask_count": (c_int64, [POINTER(OmMask)]),
    "om_mask_crop": (c_int, [POINTER(OmMask), c_int]),
    "om_mask_done": (None, [POINTER(OmMask)]),
    "om_mask_fill_holes": (c_int, [POINTER(OmMask)]),
    "om_mask_init": (c_int, [POINTER(OmMask), c_int, c_int, c_int]),
    "om_mask_keep_parts": (c_int, [POINTER(OmMask), c_int, c_double, c_void_p, c_void_p]),
    "om_mask_list_parts": (c_int, [POINTER(OmMask), c_int, c_void_p, c_int, c_void_p]),
    "om_mask_volume": (c_double, [POINTER(OmMask)]),
    "om_mat3_eigen_symmetric": (None, [OmMat3, POINTER(OmVec3), POINTER(OmMat3)]),
    "om_mat3_inverse": (c_int, [OmMat3, POINTER(OmMat3)]),
    "om_mat3_polar": (OmMat3, [OmMat3]),
    "om_mat3_svd": (None, [OmMat3, POINTER(OmMat3), POINTER(OmVec3), POINTER(OmMat3)]),
    "om_match_adoption_begin": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p, c_double]),
    "om_match_adoption_cancel": (None, [c_void_p]),
    "om_match_adoption_create": (c_int, [c_int, POINTER(c_void_p)]),
    "om_match_adoption_destroy": (None, [c_void_p]),
    "om_match_adoption_follow": (c_int, [c_void_p, c_void_p, c_void_p, c_double]),
    "om_match_adoption_force": (c_double, [c_void_p]),
    "om_match_adoption_get_goal": (None, [c_void_p, c_void_p]),
    "om_match_adoption_hash": (c_uint64, [c_void_p]),
    "om_match_adoption_is_active": (c_bool, [c_void_p]),
    "om_match_adoption_is_following": (c_bool, [c_void_p]),
    "om_match_adoption_restore": (None, [c_void_p, c_void_p]),
    "om_match_adoption_save": (None, [c_void_p, c_void_p]),
    "om_match_adoption_state_size": (c_size_t, [c_void_p]),
    "om_match_adoption_step": (c_int, [c_void_p, c_void_p, c_double]),
    "om_match_adoption_stop": (c_int, [c_void_p, c_void_p]),
    "om_match_create": (c_int, [POINTER(OmMatchDef), POINTER(c_void_p)]),
    "om_match_default_def": (OmMatchDef, [POINTER(OmScene), POINTER(OmSite)]),
    "om_match_destroy": (None, [c_void_p]),
    "om_match_estimate_done": (None, [POINTER(OmMatchEstimate)]),
    "om_match_eval": (c_int, [c_void_p, POINTER(OmMatchLoad), c_void_p, c_void_p, c_void_p]),
    "om_match_factorize": (c_int, [c_void_p, POINTER(OmMatchLoad), c_void_p]),
    "om_match_find_pairs": (c_int, [c_void_p, POINTER(OmScan), c_int, POINTER(OmMatchGrasp), c_void_p, POINTER(OmMatchPairs)]),
    "om_match_find_rest": (c_int, [c_void_p, POINTER(OmMatchLoad), c_void_p, POINTER(OmMatchRest)]),
    "om_match_live_create": (c_int, [POINTER(OmMatchLiveDef), POINTER(c_void_p)]),
    "om_match_live_default_def": (OmMatchLiveDef, [c_void_p]),
    "om_match_live_destroy": (None, [c_void_p]),
    "om_match_live_set_attached": (None, [c_void_p, c_void_p]),
    "om_match_pairs_displacement": (None, [POINTER(OmMatchView), POINTER(OmMatchPairs), c_void_p, c_void_p]),
    "om_match_pairs_done": (None, [POINTER(OmMatchPairs)]),
    "om_match_report_save": (c_int, [POINTER(OmMatchReport), c_char_p]),
    "om_match_report_save_json": (c_int, [POINTER(OmMatchReport), c_char_p]),
    "om_match_report_save_mesh": (c_int, [POINTER(OmMatchReport), c_char_p]),
    "om_match_set_young": (c_int, [c_void_p, c_double]),
    "om_match_solve": (c_int, [c_void_p, c_int, c_void_p, c_void_p]),
    "om_match_try": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), c_void_p, c_void_p, POINTER(OmMatchTrial)]),
    "om_match_update": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmProgress), POINTER(OmMatchEstimate)]),
    "om_match_update_with": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmMatchAdvice), POINTER(OmProgress), POINTER(OmMatchEstimate)]),
    "om_match_view": (POINTER(OmMatchView), [c_void_p]),
    "om_material_lame": (None, [POINTER(OmMaterial), c_void_p, c_void_p, c_void_p]),
    "om_material_validate": (c_int, [POINTER(OmMaterial), c_char_p]),
    "om_mesh_frame_join": (OmMeshFrame, [OmMeshFrame, OmMeshFrame]),
    "om_model_build": (c_int, [POINTER(OmModelDef), POINTER(OmProgress), POINTER(OmPatient), POINTER(OmModelReport)]),
    "om_model_build_volume": (c_int, [POINTER(OmModelDef), POINTER(OmVolume), POINTER(OmProgress), POINTER(OmPatient), POINTER(OmModelReport)]),
    "om_model_default_def": (OmModelDef, [c_char_p, c_double]),
    "om_model_direction": (c_int, [c_char_p, c_bool, POINTER(OmVec3)]),
    "om_model_parse_attach": (c_int, [c_char_p, POINTER(OmAttachDef)]),
    "om_modulus_create": (c_int, [POINTER(OmModulusDef), POINTER(c_void_p)]),
    "om_modulus_default_def": (OmModulusDef, [POINTER(OmScene), POINTER(OmSite)]),
    "om_modulus_destroy": (None, [c_void_p]),
    "om_monitor_create": (c_int, [POINTER(OmMonitorDef), POINTER(c_void_p)]),
    "om_monitor_default_def": (OmMonitorDef, [POINTER(OmScene), POINTER(OmWorld), POINTER(OmSite)]),
    "om_monitor_destroy": (None, [c_void_p]),
    "om_monitor_frame": (c_int, [c_void_p, POINTER(OmObservation), c_void_p, c_bool, POINTER(OmMonitorFrame)]),
    "om_monitor_is_due": (c_bool, [c_void_p, c_double]),
    "om_monitor_next_fold_state": (c_int, [POINTER(OmSceneMonitor), c_int, c_double]),
    "om_monitor_next_part_state": (c_int, [POINTER(OmSceneMonitor), c_int, c_double]),
    "om_monitor_next_state": (c_int, [POINTER(OmSceneMonitor), c_int, c_double]),
    "om_monitor_reset": (None, [c_void_p]),
    "om_monitor_settings": (POINTER(OmSceneMonitor), [c_void_p]),
    "om_monitor_sources": (c_uint, [c_void_p, POINTER(OmWorld)]),
    "om_monitor_try": (c_int, [c_void_p, POINTER(OmObservation), c_void_p, POINTER(OmMonitorFrame)]),
    "om_nearest_word": (c_char_p, [c_char_p, POINTER(c_char_p), c_int]),
    "om_net_add_activation": (c_int, [c_void_p, c_int, c_int, c_float]),
    "om_net_add_batch_norm": (c_int, [c_void_p, c_char_p, c_int]),
    "om_net_add_concat": (c_int, [c_void_p, c_int, c_void_p]),
    "om_net_add_conv": (c_int, [c_void_p, c_char_p, c_int, OmNetConv]),
    "om_net_add_conv_up": (c_int, [c_void_p, c_char_p, c_int, OmNetConv]),
    "om_net_add_dense": (c_int, [c_void_p, c_char_p, c_int, c_int]),
    "om_net_add_dropout": (c_int, [c_void_p, c_int, c_float]),
    "om_net_add_group_norm": (c_int, [c_void_p, c_char_p, c_int, c_int]),
    "om_net_add_input": (c_int, [c_void_p, c_char_p, OmNetShape]),
    "om_net_add_mask": (c_int, [c_void_p, c_int, c_void_p]),
    "om_net_add_max_pool": (c_int, [c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_net_add_upsample": (c_int, [c_void_p, c_int, c_void_p]),
    "om_net_conv": (OmNetConv, [c_int, c_int]),
    "om_net_conv_strided": (OmNetConv, [c_int, c_int, c_int, c_int]),
    "om_net_create": (c_int, [POINTER(c_void_p)]),
    "om_net_describe": (c_int, [c_void_p, POINTER(OmText)]),
    "om_net_destroy": (None, [c_void_p]),
    "om_net_fast_type": (c_int, []),
    "om_net_find_parameter": (c_int, [c_void_p, c_char_p]),
    "om_net_finish": (c_int, [c_void_p, c_int]),
    "om_net_hash": (c_uint64, [c_void_p]),
    "om_net_in_size": (c_int64, [c_void_p]),
    "om_net_init_parameters": (None, [c_void_p, c_uint64, c_void_p]),
    "om_net_layer": (POINTER(OmLayer), [c_void_p, c_int]),
    "om_net_layer_count": (c_int, [c_void_p]),
    "om_net_load": (c_int, [c_void_p, c_char_p, c_void_p]),
    "om_net_out_size": (c_int64, [c_void_p]),
    "om_net_output": (c_int, [c_void_p]),
    "om_net_parameter": (POINTER(OmNetParameter), [c_void_p, c_int]),
    "om_net_parameter_count": (c_int, [c_void_p]),
    "om_net_parameter_size": (c_size_t, [c_void_p]),
    "om_net_run_backward": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p]),
    "om_net_run_create": (c_int, [c_void_p, POINTER(OmNetRunDef), POINTER(c_void_p)]),
    "om_net_run_default_def": (OmNetRunDef, [c_int]),
    "om_net_run_destroy": (None, [c_void_p]),
    "om_net_run_forward": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_net_run_memory": (c_size_t, [c_void_p]),
    "om_net_run_set_parameters": (c_int, [c_void_p, c_void_p]),
    "om_net_run_set_step": (None, [c_void_p, c_uint64, c_int64]),
    "om_net_run_update_statistics": (None, [c_void_p, c_void_p]),
    "om_net_save": (c_int, [c_void_p, c_void_p, POINTER(OmTextPair), c_int, c_char_p]),
    "om_net_save_onnx": (c_int, [c_void_p, c_void_p, POINTER(OmTextPair), c_int, c_char_p]),
    "om_noise_perlin": (c_double, [OmVec3, c_uint64]),
    "om_number_parse": (c_bool, [POINTER(c_char_p), c_char_p, c_void_p]),
    "om_number_write": (c_int, [c_char_p, c_double]),
    "om_observation_done": (None, [POINTER(OmObservation)]),
    "om_optim_create": (c_int, [POINTER(OmOptimDef), c_void_p, POINTER(c_void_p)]),
    "om_optim_default_def": (OmOptimDef, []),
    "om_optim_destroy": (None, [c_void_p]),
    "om_optim_get_average": (None, [c_void_p, c_void_p, c_void_p]),
    "om_optim_restore": (c_int, [c_void_p, c_int64, c_void_p]),
    "om_optim_save": (None, [c_void_p, c_void_p, c_void_p]),
    "om_optim_size": (c_size_t, [c_void_p]),
    "om_optim_step": (c_int, [c_void_p, c_double, c_void_p, c_void_p, c_void_p]),
    "om_orthogonal": (OmVec3, [OmVec3]),
    "om_parallel_for": (None, [c_int, c_int, c_int, OmRangeFn, c_void_p]),
    "om_parallel_team": (None, [c_int, OmTeamFn, c_void_p]),
    "om_patch_default_def": (OmPatchDef, [c_double, c_uint64]),
    "om_path_check_apart": (c_int, [c_char_p, c_char_p]),
    "om_path_clean": (None, [c_char_p, c_bool]),
    "om_path_dir": (c_int, [c_char_p, c_char_p, c_size_t]),
    "om_path_exists": (c_bool, [c_char_p]),
    "om_path_extension": (None, [c_char_p, c_char_p, c_size_t]),
    "om_path_join": (c_int, [c_char_p, c_char_p, c_char_p, c_size_t]),
    "om_path_make_dir": (c_int, [c_char_p]),
    "om_path_remove": (c_int, [c_char_p]),
    "om_path_share": (c_int, [c_char_p, c_char_p, c_size_t]),
    "om_patient_add_pictures": (c_int, [POINTER(OmPatient), POINTER(OmReport)]),
    "om_patient_done": (None, [POINTER(OmPatient)]),
    "om_patient_find_material": (c_int, [POINTER(OmPatient), c_int]),
    "om_patient_load": (c_int, [c_char_p, POINTER(OmPatient)]),
    "om_patient_save": (c_int, [POINTER(OmPatient), POINTER(OmModelReport), c_char_p]),
    "om_pbd_clusters": (c_int, [c_void_p, POINTER(c_void_p), POINTER(c_void_p)]),
    "om_pbd_default_def": (OmPbdDef, [c_int]),
    "om_pbd_engine": (POINTER(OmTissueEngine), []),
    "om_pbd_modulus": (c_double, [c_void_p, c_double]),
    "om_pbd_sample_sdf": (c_int, [POINTER(OmSdf), c_double, POINTER(OmTetMesh), c_void_p]),
    "om_pbd_sample_sheet": (c_int, [c_double, c_double, c_double, c_double, POINTER(OmTetMesh), c_void_p]),
    "om_pbd_sample_surface": (c_int, [POINTER(OmSurface), c_double, POINTER(OmTetMesh), c_void_p]),
    "om_pbd_substeps": (c_int, [c_void_p, c_double]),
    "om_pbd_weight_strain": (c_double, [c_void_p, c_double]),
    "om_picture_done": (None, [POINTER(OmPicture)]),
    "om_picture_encode_png": (c_int, [POINTER(OmPicture), POINTER(OmText)]),
    "om_picture_init": (c_int, [POINTER(OmPicture), c_int, c_int, c_int]),
    "om_picture_load_png": (c_int, [c_char_p, POINTER(OmPicture)]),
    "om_picture_load_png16": (c_int, [c_char_p, POINTER(c_void_p), c_void_p, c_void_p]),
    "om_picture_save_png": (c_int, [POINTER(OmPicture), c_char_p]),
    "om_picture_save_png16": (c_int, [c_void_p, c_int, c_int, c_char_p]),
    "om_picture_shrink": (c_int, [POINTER(OmPicture), c_int, POINTER(OmPicture)]),
    "om_plan_print": (c_int, [POINTER(OmPlan), POINTER(OmText)]),
    "om_plan_print_action": (c_int, [POINTER(OmPlan), c_int, POINTER(OmText)]),
    "om_plane_obstacle": (OmTissueObstacle, [POINTER(OmContactPlane)]),
    "om_planner_create": (c_int, [POINTER(OmPlannerDef), POINTER(c_void_p)]),
    "om_planner_default_def": (OmPlannerDef, []),
    "om_planner_destroy": (None, [c_void_p]),
    "om_planner_explain": (c_int, [c_void_p, POINTER(OmSituation), POINTER(OmPlan), c_int, POINTER(OmText)]),
    "om_planner_has_both_arms": (c_bool, [c_void_p]),
    "om_planner_program": (c_char_p, []),
    "om_planner_solve": (c_int, [c_void_p, POINTER(OmSituation), POINTER(OmPlan)]),
    "om_point_cloud_done": (None, [POINTER(OmPointCloud)]),
    "om_point_cloud_load": (c_int, [c_char_p, OmMeshFrame, POINTER(OmPointCloud), POINTER(OmMeshFrame)]),
    "om_point_cloud_save": (c_int, [POINTER(OmPointCloud), c_char_p, OmMeshFrame]),
    "om_point_tree_create": (c_int, [c_int, c_void_p, POINTER(c_void_p)]),
    "om_point_tree_destroy": (None, [c_void_p]),
    "om_point_tree_find": (c_int, [c_void_p, OmVec3, c_void_p]),
    "om_point_tree_find_many": (c_int, [c_void_p, OmVec3, c_int, c_void_p]),
    "om_pose_look_at": (OmPose, [OmVec3, OmVec3, OmVec3]),
    "om_preplan_add_maps": (c_int, [POINTER(OmPreplan), POINTER(OmReport)]),
    "om_preplan_default_def": (OmPreplanDef, [POINTER(OmScene)]),
    "om_preplan_get_exposure": (None, [POINTER(OmPreplan), POINTER(OmExposure)]),
    "om_preplan_load": (c_int, [c_char_p, POINTER(OmPreplan)]),
    "om_preplan_make_plan": (None, [POINTER(OmPreplan), POINTER(OmPlan)]),
    "om_preplan_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmPreplan)]),
    "om_preplan_print": (c_int, [POINTER(OmPreplan), POINTER(OmText)]),
    "om_preplan_run": (c_int, [POINTER(OmPreplanDef), POINTER(OmProgress), POINTER(OmPreplan)]),
    "om_preplan_save": (c_int, [POINTER(OmPreplan), c_char_p]),
    "om_preplan_save_report": (c_int, [POINTER(OmPreplan), c_char_p]),
    "om_preplan_verdict_text": (c_char_p, [c_int]),
    "om_preplan_verdict_word": (c_char_p, [c_int]),
    "om_press_create": (c_int, [POINTER(OmPressDef), c_void_p, POINTER(c_void_p)]),
    "om_press_default_def": (OmPressDef, [c_void_p]),
    "om_press_destroy": (None, [c_void_p]),
    "om_press_embedding": (POINTER(OmEmbedding), [c_void_p]),
    "om_press_eval_gap": (c_double, [c_void_p, c_void_p, OmPose]),
    "om_press_move": (c_int, [c_void_p, OmPose]),
    "om_press_place": (c_int, [c_void_p, c_void_p, c_void_p, OmPose]),
    "om_press_pose": (OmPose, [c_void_p]),
    "om_press_report": (POINTER(OmPressReport), [c_void_p]),
    "om_press_step": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p, OmPose, c_double, POINTER(OmPressReport)]),
    "om_press_surface": (POINTER(OmSurface), [c_void_p]),
    "om_probe_create": (c_int, [POINTER(OmProbeDef), POINTER(c_void_p)]),
    "om_probe_default_def": (OmProbeDef, [c_int]),
    "om_probe_destroy": (None, [c_void_p]),
    "om_probe_eval_distance": (c_double, [c_void_p, OmVec3, POINTER(OmVec3)]),
    "om_probe_get_bounds": (None, [c_void_p, POINTER(OmVec3), POINTER(OmVec3)]),
    "om_probe_get_surface": (c_int, [c_void_p, POINTER(OmSurface)]),
    "om_probe_obstacle": (OmTissueObstacle, [c_void_p, OmPose, OmPose, c_double]),
    "om_progress_bar_done": (None, [POINTER(OmProgressBar)]),
    "om_progress_bar_draw": (None, [POINTER(OmProgressBar), c_char_p, c_double, c_double]),
    "om_progress_bar_init": (None, [POINTER(OmProgressBar), c_void_p]),
    "om_progress_report": (c_int, [POINTER(OmProgress), c_char_p, c_double, c_double]),
    "om_psm_capsules": (None, [POINTER(OmPsm), c_void_p, c_double, POINTER(OmPsmCapsule)]),
    "om_psm_default": (OmPsm, [c_int, OmPose]),
    "om_psm_forward": (OmPose, [POINTER(OmPsm), c_void_p]),
    "om_psm_inverse": (c_int, [POINTER(OmPsm), OmPose, c_void_p, c_void_p]),
    "om_psm_inverse_turned": (c_int, [POINTER(OmPsm), OmPose, c_double, c_void_p, c_void_p, POINTER(OmPose)]),
    "om_psm_jacobian": (None, [POINTER(OmPsm), c_void_p, c_void_p]),
    "om_psm_joint_name": (c_char_p, [c_int]),
    "om_psm_joint_torque": (None, [POINTER(OmPsm), c_void_p, OmVec3, OmVec3, c_void_p]),
    "om_psm_load_instrument": (c_int, [c_char_p, POINTER(OmPsm)]),
    "om_psm_parse_instrument": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmPsm)]),
    "om_psm_surface": (c_int, [POINTER(OmPsm), c_void_p, c_double, POINTER(OmSurface)]),
    "om_psm_surface_update": (None, [POINTER(OmPsm), c_void_p, c_double, POINTER(OmSurface)]),
    "om_quantile": (c_double, [c_void_p, c_int, c_double]),
    "om_quat_axis_angle": (OmQuat, [OmVec3, c_double]),
    "om_quat_from_mat3": (OmQuat, [OmMat3]),
    "om_quat_mul": (OmQuat, [OmQuat, OmQuat]),
    "om_quat_normalize": (OmQuat, [OmQuat]),
    "om_quat_rotate": (OmVec3, [OmQuat, OmVec3]),
    "om_quat_slerp": (OmQuat, [OmQuat, OmQuat, c_double]),
    "om_quat_to_mat3": (OmMat3, [OmQuat]),
    "om_realloc": (c_void_p, [c_void_p, c_size_t, c_size_t, c_size_t]),
    "om_recorder_create": (c_int, [POINTER(OmRecorderDef), POINTER(c_void_p)]),
    "om_recorder_default_def": (OmRecorderDef, [c_char_p, POINTER(OmScene), POINTER(OmWorld), c_void_p, c_void_p]),
    "om_recorder_destroy": (None, [c_void_p]),
    "om_recorder_listener": (OmLoopListener, [c_void_p]),
    "om_recorder_place": (c_char_p, [c_void_p]),
    "om_recording_abort": (None, [c_void_p]),
    "om_recording_add_step": (c_int, [c_void_p, c_double, c_void_p, POINTER(c_void_p)]),
    "om_recording_begin": (c_int, [c_char_p, POINTER(OmTetMesh), POINTER(OmMeshArray), c_int, POINTER(c_void_p)]),
    "om_recording_begin_scene": (c_int, [c_char_p, POINTER(OmTetMesh), c_char_p, POINTER(OmRecordedSurface), c_int, POINTER(OmRecordingArrays), POINTER(c_void_p)]),
    "om_recording_end": (c_int, [c_void_p]),
    "om_register_default_def": (OmRegisterDef, []),
    "om_replay_default_def": (OmReplayDef, [c_char_p]),
    "om_replay_result_done": (None, [POINTER(OmReplayResult)]),
    "om_report_begin": (None, [POINTER(OmReport), c_char_p, c_char_p]),
    "om_report_begin_fold": (None, [POINTER(OmReport), c_char_p]),
    "om_report_chart": (None, [POINTER(OmReport), POINTER(OmReportChart)]),
    "om_report_details": (None, [POINTER(OmReport), c_char_p, c_char_p]),
    "om_report_done": (None, [POINTER(OmReport)]),
    "om_report_end_fold": (None, [POINTER(OmReport)]),
    "om_report_facts": (None, [POINTER(OmReport), POINTER(c_char_p), POINTER(c_char_p), c_int]),
    "om_report_heading": (None, [POINTER(OmReport), c_char_p]),
    "om_report_links": (None, [POINTER(OmReport), c_char_p, POINTER(c_char_p), POINTER(c_char_p), c_int]),
    "om_report_listing": (None, [POINTER(OmReport), c_char_p]),
    "om_report_paragraph": (None, [POINTER(OmReport), c_char_p]),
    "om_report_picture": (None, [POINTER(OmReport), POINTER(OmPicture), c_char_p]),
    "om_report_save": (c_int, [POINTER(OmReport), c_char_p]),
    "om_report_table": (None, [POINTER(OmReport), POINTER(c_char_p), c_int, POINTER(c_char_p), c_int]),
    "om_report_verdict": (None, [POINTER(OmReport), c_char_p, c_bool]),
    "om_retract_calibrate_force": (c_int, [POINTER(OmScene), c_int, c_int, POINTER(OmProgress), POINTER(OmForceCalibration)]),
    "om_retract_check": (c_int, [POINTER(OmRetractDef), POINTER(OmProgress), POINTER(OmRetractEstimate)]),
    "om_retract_default_def": (OmRetractDef, [POINTER(OmScene)]),
    "om_retract_outcome_text": (c_char_p, [c_int]),
    "om_retract_replay": (c_int, [POINTER(OmReplayDef), POINTER(OmProgress), POINTER(OmReplayResult)]),
    "om_retract_result_done": (None, [POINTER(OmRetractResult)]),
    "om_retract_run": (c_int, [POINTER(OmRetractDef), POINTER(OmProgress), POINTER(OmRetractResult)]),
    "om_retract_search": (c_int, [POINTER(OmScene), c_double, c_int, POINTER(OmProgress), POINTER(OmSearchResult)]),
    "om_retract_search_both": (c_int, [POINTER(OmScene), c_double, c_int, c_int, POINTER(OmProgress), POINTER(OmSearchResult)]),
    "om_rl_actor_act": (c_int, [c_void_p, c_void_p, POINTER(OmRng), c_void_p, c_void_p]),
    "om_rl_actor_create": (c_int, [c_void_p, c_int, POINTER(c_void_p)]),
    "om_rl_actor_destroy": (None, [c_void_p]),
    "om_rl_actor_update": (c_int, [c_void_p]),
    "om_rl_approach_observe": (None, [c_void_p, c_void_p, c_bool, c_void_p]),
    "om_rl_demos_check": (c_int, [POINTER(OmRlDemos), POINTER(OmRlTask)]),
    "om_rl_demos_done": (None, [POINTER(OmRlDemos)]),
    "om_rl_demos_load": (c_int, [c_char_p, POINTER(OmRlDemos)]),
    "om_rl_demos_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmRlDemos)]),
    "om_rl_demos_record": (c_int, [POINTER(OmRlTask), c_int, c_uint64, POINTER(OmProgress), POINTER(OmRlDemos)]),
    "om_rl_demos_save": (c_int, [POINTER(OmRlDemos), c_char_p]),
    "om_rl_drive_create": (c_int, [POINTER(OmRlTask), c_uint64, POINTER(c_void_p)]),
    "om_rl_drive_destroy": (None, [c_void_p]),
    "om_rl_drive_info": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_rl_drive_keep": (c_int, [c_void_p, POINTER(OmRlDemos)]),
    "om_rl_drive_now": (POINTER(OmRlDriveNow), [c_void_p]),
    "om_rl_drive_render": (c_int, [c_void_p, POINTER(OmPicture)]),
    "om_rl_drive_reset": (c_int, [c_void_p, c_int]),
    "om_rl_drive_step": (c_int, [c_void_p, c_void_p]),
    "om_rl_eval_default_def": (OmRlEvalDef, [POINTER(OmRlTask), c_void_p]),
    "om_rl_eval_done": (None, [POINTER(OmRlEval)]),
    "om_rl_eval_run": (c_int, [POINTER(OmRlEvalDef), POINTER(OmProgress), POINTER(OmRlEval)]),
    "om_rl_method_name": (c_char_p, [c_int]),
    "om_rl_policy_check": (c_int, [c_void_p, POINTER(OmRlTask)]),
    "om_rl_policy_create": (c_int, [POINTER(OmRlPolicyDef), POINTER(c_void_p)]),
    "om_rl_policy_def": (POINTER(OmRlPolicyDef), [c_void_p]),
    "om_rl_policy_default_def": (OmRlPolicyDef, [POINTER(OmRlTask)]),
    "om_rl_policy_destroy": (None, [c_void_p]),
    "om_rl_policy_load": (c_int, [c_char_p, POINTER(c_void_p)]),
    "om_rl_policy_net": (c_void_p, [c_void_p, c_int]),
    "om_rl_policy_parameters": (c_void_p, [c_void_p, c_int]),
    "om_rl_policy_save": (c_int, [c_void_p, POINTER(OmTextPair), c_int, c_char_p]),
    "om_rl_policy_save_onnx": (c_int, [c_void_p, c_char_p]),
    "om_rl_retract_create": (c_int, [POINTER(OmRlRetractDef), POINTER(POINTER(OmRlTask))]),
    "om_rl_retract_default_def": (OmRlRetractDef, []),
    "om_rl_retract_survey": (c_int, [POINTER(OmRlTask), c_int, POINTER(OmRlSurvey)]),
    "om_rl_task_create": (c_int, [c_char_p, POINTER(OmRlSetting), c_int, POINTER(POINTER(OmRlTask))]),
    "om_rl_task_destroy": (None, [POINTER(OmRlTask)]),
    "om_rl_task_kind": (POINTER(OmRlTaskKind), [c_int]),
    "om_rl_task_nlogit": (c_int, [POINTER(OmRlTask)]),
    "om_rl_task_press": (c_bool, [POINTER(OmRlTask), c_int, c_void_p]),
    "om_rl_task_rest": (None, [POINTER(OmRlTask), c_void_p]),
    "om_rl_trace_done": (None, [POINTER(OmRlTrace)]),
    "om_rl_trace_follow": (c_int, [POINTER(OmRlTrace), c_double, c_void_p, POINTER(OmRlFollow)]),
    "om_rl_trace_load": (c_int, [c_char_p, POINTER(OmRlTrace)]),
    "om_rl_trace_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmRlTrace)]),
    "om_rl_train_default_def": (OmRlTrainDef, [POINTER(OmRlTask), c_char_p]),
    "om_rl_train_result_done": (None, [POINTER(OmRlTrainResult)]),
    "om_rl_train_run": (c_int, [POINTER(OmRlTrainDef), POINTER(OmProgress), POINTER(OmRlTrainResult)]),
    "om_rl_vec_create": (c_int, [POINTER(OmRlVecDef), POINTER(c_void_p)]),
    "om_rl_vec_default_def": (OmRlVecDef, [POINTER(OmRlTask)]),
    "om_rl_vec_destroy": (None, [c_void_p]),
    "om_rl_vec_expert": (c_int, [c_void_p, c_int, POINTER(OmRng), c_void_p]),
    "om_rl_vec_info": (c_int, [c_void_p, c_int, c_void_p]),
    "om_rl_vec_nenv": (c_int, [c_void_p]),
    "om_rl_vec_observe": (None, [c_void_p, c_void_p]),
    "om_rl_vec_render": (c_int, [c_void_p, c_int, POINTER(OmPicture)]),
    "om_rl_vec_reset": (c_int, [c_void_p, c_void_p]),
    "om_rl_vec_reset_one": (c_int, [c_void_p, c_int, c_int, c_void_p]),
    "om_rl_vec_restore": (c_int, [c_void_p, c_void_p]),
    "om_rl_vec_save": (None, [c_void_p, c_void_p]),
    "om_rl_vec_set_seed": (None, [c_void_p, c_uint64]),
    "om_rl_vec_size": (c_size_t, [c_void_p]),
    "om_rl_vec_step": (c_int, [c_void_p, c_void_p, POINTER(OmRlStep)]),
    "om_rl_vec_task": (POINTER(OmRlTask), [c_void_p]),
    "om_rng_below": (c_uint32, [POINTER(OmRng), c_uint32]),
    "om_rng_init": (OmRng, [c_uint64, c_uint64]),
    "om_rng_normal": (c_double, [POINTER(OmRng)]),
    "om_rng_range": (c_double, [POINTER(OmRng), c_double, c_double]),
    "om_rng_u32": (c_uint32, [POINTER(OmRng)]),
    "om_rng_uniform": (c_double, [POINTER(OmRng)]),
    "om_roi_meter_create": (c_int, [POINTER(OmSite), POINTER(c_void_p)]),
    "om_roi_meter_destroy": (None, [c_void_p]),
    "om_roi_meter_look": (c_int, [c_void_p, POINTER(OmWorldPicture), c_void_p]),
    "om_roi_meter_window": (OmWindow, [c_void_p]),
    "om_roi_visibility": (c_int, [POINTER(OmWorldPicture), POINTER(OmSite), c_void_p]),
    "om_scan_check": (c_int, [POINTER(OmScan)]),
    "om_scan_check_model": (c_int, [POINTER(OmScan), POINTER(OmSurface), c_double, POINTER(OmScanFit)]),
    "om_scan_default_def": (OmScanDef, [POINTER(OmWorld), POINTER(OmSite)]),
    "om_scan_done": (None, [POINTER(OmScan)]),
    "om_scan_file_default_def": (OmScanFileDef, []),
    "om_scan_from_observation": (c_int, [POINTER(OmScanDef), POINTER(OmObservation), POINTER(OmScan)]),
    "om_scan_init": (c_int, [c_int, c_int, POINTER(OmScan)]),
    "om_scan_learn_range": (c_int, [POINTER(OmPicture), POINTER(OmScanRegion), POINTER(OmSenseRange)]),
    "om_scan_load": (c_int, [c_char_p, POINTER(OmScanFileDef), POINTER(OmScan), POINTER(OmScanFileReport)]),
    "om_scan_register": (c_int, [POINTER(OmRegisterDef), POINTER(OmSurface), POINTER(OmScan), POINTER(OmRegistration)]),
    "om_scan_save": (c_int, [POINTER(OmScan), c_char_p, OmMeshFrame]),
    "om_scene_camera_place": (OmCamera, [POINTER(OmSceneCamera), OmPose]),
    "om_scene_default": (OmScene, []),
    "om_scene_load": (c_int, [c_char_p, POINTER(OmScene)]),
    "om_scene_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmScene)]),
    "om_scene_print": (c_int, [POINTER(OmScene), c_bool, POINTER(OmText)]),
    "om_scene_print_example": (c_int, [POINTER(OmText)]),
    "om_scene_print_keys": (c_int, [POINTER(OmText)]),
    "om_schedule_constant": (OmSchedule, [c_double]),
    "om_schedule_cosine": (OmSchedule, [c_double, c_double]),
    "om_schedule_one_cycle": (OmSchedule, [c_double]),
    "om_schedule_rate": (c_double, [POINTER(OmSchedule), c_int64, c_int64]),
    "om_sdf_bounds": (None, [POINTER(OmSdf), POINTER(OmVec3), POINTER(OmVec3)]),
    "om_sdf_default_def": (OmSdfDef, [c_double]),
    "om_sdf_done": (None, [POINTER(OmSdf)]),
    "om_sdf_eval": (c_double, [POINTER(OmSdf), OmVec3, POINTER(OmVec3)]),
    "om_sdf_from_function": (c_int, [OmShapeFn, c_void_p, OmVec3, OmVec3, POINTER(OmSdfDef), POINTER(OmSdf)]),
    "om_sdf_from_mask": (c_int, [POINTER(OmMask), POINTER(OmSdfDef), POINTER(OmSdf)]),
    "om_sdf_from_surface": (c_int, [POINTER(OmSurface), POINTER(OmSdfDef), POINTER(OmSdf)]),
    "om_sdf_obstacle": (OmTissueObstacle, [POINTER(OmSdf)]),
    "om_sdf_shape_fn": (c_double, [c_void_p, OmVec3]),
    "om_sense_count_visible": (c_int, [c_void_p, POINTER(OmCamera), c_void_p, c_void_p, c_int, c_uint64, POINTER(OmVisibility)]),
    "om_sense_depth": (c_int, [c_void_p, POINTER(OmCamera), c_int, c_void_p, c_void_p, c_void_p]),
    "om_sense_hsv": (None, [c_void_p, c_void_p]),
    "om_sense_look": (OmSenseLook, [c_int]),
    "om_sense_options_default": (OmSenseOptions, []),
    "om_sense_part_of": (c_int, [c_void_p]),
    "om_sense_range": (OmSenseRange, [c_int]),
    "om_sense_range_has": (c_bool, [POINTER(OmSenseRange), c_void_p]),
    "om_sense_render": (c_int, [c_void_p, POINTER(OmCamera), POINTER(OmSenseOptions), POINTER(OmPicture)]),
    "om_sense_scene_add": (c_int, [c_void_p, POINTER(OmSurface), POINTER(OmSenseLook), c_void_p]),
    "om_sense_scene_commit": (c_int, [c_void_p]),
    "om_sense_scene_create": (c_int, [POINTER(c_void_p)]),
    "om_sense_scene_destroy": (None, [c_void_p]),
    "om_sense_scene_show": (None, [c_void_p, c_int, c_bool]),
    "om_sense_scene_update": (None, [c_void_p, c_int, c_void_p, c_void_p]),
    "om_sense_triangles": (c_int, [c_void_p, POINTER(OmCamera), c_int, c_void_p, c_void_p, c_void_p]),
    "om_sense_visibility": (c_int, [c_void_p, POINTER(OmCamera), c_void_p, c_void_p, c_int, c_uint64, c_void_p]),
    "om_series_append": (c_int, [POINTER(OmSeries), POINTER(OmObservation)]),
    "om_series_append_stereo": (c_int, [POINTER(OmSeries), c_double, OmPose, POINTER(OmPicture), POINTER(OmPicture), POINTER(OmObservation)]),
    "om_series_begin": (c_int, [c_char_p, POINTER(OmCamera), POINTER(OmCamera), POINTER(OmSeries)]),
    "om_series_done": (None, [POINTER(OmSeries)]),
    "om_series_get_frame": (c_int, [POINTER(OmSeries), c_int, POINTER(OmStereoDef), POINTER(OmObservation)]),
    "om_series_load": (c_int, [c_char_p, POINTER(OmSeries)]),
    "om_series_parse": (c_int, [c_char_p, c_size_t, c_char_p, c_char_p, POINTER(OmSeries)]),
    "om_site_attached_area": (c_double, [POINTER(OmSite)]),
    "om_site_build": (c_int, [POINTER(OmScene), c_int, POINTER(OmProgress), POINTER(OmSite)]),
    "om_site_done": (None, [POINTER(OmSite)]),
    "om_site_get_material": (OmSiteMaterial, [POINTER(OmSite), c_int]),
    "om_site_scale_attachments": (c_int, [POINTER(OmScene), c_double, c_int, POINTER(OmSite)]),
    "om_site_set_numbers": (None, [POINTER(OmScene), POINTER(OmSite)]),
    "om_situation_init": (None, [POINTER(OmSituation), c_int, c_double]),
    "om_solver_create": (c_int, [POINTER(OmSolverDef), POINTER(OmBsr), c_void_p, POINTER(c_void_p)]),
    "om_solver_default_def": (OmSolverDef, []),
    "om_solver_destroy": (None, [c_void_p]),
    "om_solver_memory": (c_size_t, [c_void_p]),
    "om_solver_refresh": (c_int, [c_void_p, POINTER(OmBsr)]),
    "om_solver_refresh_diagonal": (c_int, [c_void_p, POINTER(OmBsr)]),
    "om_solver_set_fixed": (None, [c_void_p, c_void_p]),
    "om_solver_set_reference": (None, [c_void_p, c_double]),
    "om_solver_set_tolerance": (None, [c_void_p, c_double]),
    "om_solver_sign": (c_int, [c_void_p]),
    "om_solver_solve": (c_int, [c_void_p, POINTER(OmBsr), c_int, c_void_p, c_void_p, POINTER(OmSolveInfo)]),
    "om_solver_solve_gmres": (c_int, [c_void_p, POINTER(OmBsr), POINTER(OmBsr), c_double, c_void_p, c_void_p, POINTER(OmSolveInfo)]),
    "om_sort_doubles": (None, [c_void_p, c_int]),
    "om_sort_ints": (None, [c_void_p, c_int]),
    "om_spectral_basis_done": (None, [POINTER(OmSpectralBasis)]),
    "om_spectral_basis_init": (c_int, [POINTER(OmSurface), c_int, POINTER(OmSpectralBasis)]),
    "om_spectral_basis_init_part": (c_int, [POINTER(OmSurface), c_void_p, c_int, POINTER(OmSpectralBasis)]),
    "om_spectral_basis_init_scan": (c_int, [POINTER(OmScan), c_int, POINTER(OmSpectralBasis)]),
    "om_spectral_default_def": (OmSpectralDef, []),
    "om_spectral_get_matrix": (c_int, [POINTER(OmSpectralBasis), POINTER(OmSpectralBasis), c_void_p, c_int, c_int, c_void_p]),
    "om_spectral_map_from_landmarks": (c_int, [POINTER(OmSpectralBasis), POINTER(OmSpectralBasis), c_int, c_int, c_void_p, c_void_p, c_void_p]),
    "om_spectral_map_from_matrix": (c_int, [POINTER(OmSpectralDef), POINTER(OmSpectralBasis), POINTER(OmSpectralBasis), c_int, c_int, c_void_p, c_void_p]),
    "om_spectral_map_from_nearest": (c_int, [POINTER(OmSpectralBasis), c_void_p, POINTER(OmSpectralBasis), c_void_p, c_void_p]),
    "om_spectral_map_to_surface": (c_int, [POINTER(OmSpectralDef), POINTER(OmSpectralBasis), POINTER(OmSurface), POINTER(OmSpectralBasis), c_void_p, c_void_p, c_void_p]),
    "om_spectral_zoomout": (c_int, [POINTER(OmSpectralDef), POINTER(OmSpectralBasis), POINTER(OmSpectralBasis), c_void_p, POINTER(OmSpectralReport)]),
    "om_spring_engine": (POINTER(OmTissueEngine), []),
    "om_status_text": (c_char_p, [c_int]),
    "om_stereo_default_def": (OmStereoDef, []),
    "om_stereo_depth": (c_int, [POINTER(OmStereoDef), POINTER(OmStereoPair), c_void_p, POINTER(OmStereoReport)]),
    "om_stereo_rectify": (c_int, [POINTER(OmStereoPair), POINTER(OmCamera), POINTER(OmCamera)]),
    "om_store_abort": (None, [c_void_p]),
    "om_store_array": (None, [c_void_p, c_char_p, c_int, c_void_p, c_int, c_char_p, c_void_p]),
    "om_store_begin": (c_int, [c_char_p, c_int, POINTER(c_void_p)]),
    "om_store_check_array": (c_int, [c_void_p, c_char_p, c_void_p]),
    "om_store_close": (None, [c_void_p]),
    "om_store_get_array": (c_int, [c_void_p, c_char_p, c_int, c_void_p, c_void_p]),
    "om_store_get_records": (c_int, [c_void_p, c_char_p, POINTER(OmStoreField), c_int, c_void_p, c_size_t, c_int]),
    "om_store_get_shape": (c_int, [c_void_p, c_char_p, c_void_p]),
    "om_store_get_value": (c_int, [c_void_p, c_char_p, c_int, c_int, c_void_p]),
    "om_store_group": (None, [c_void_p, c_char_p]),
    "om_store_open": (c_int, [c_char_p, c_size_t, c_char_p, c_int, c_char_p, POINTER(c_void_p)]),
    "om_store_records": (None, [c_void_p, c_char_p, POINTER(OmStoreField), c_int, c_void_p, c_size_t, c_int]),
    "om_store_save": (c_int, [c_void_p, c_char_p]),
    "om_store_shard_path": (c_int, [c_char_p, c_int, c_char_p, c_size_t]),
    "om_store_shard_range": (None, [c_char_p, c_void_p, c_void_p]),
    "om_store_text": (None, [c_void_p, c_char_p, c_char_p]),
    "om_store_value": (None, [c_void_p, c_char_p, c_int, c_int, c_void_p]),
    "om_stuff_default_def": (OmStuffDef, [c_double, OmShapeFn, c_void_p, OmVec3, OmVec3]),
    "om_surface_check": (c_int, [POINTER(OmSurface), POINTER(OmSurfaceCheck)]),
    "om_surface_check_closed": (c_int, [POINTER(OmSurface), c_void_p]),
    "om_surface_done": (None, [POINTER(OmSurface)]),
    "om_surface_from_sdf": (c_int, [POINTER(OmSdf), c_double, POINTER(OmSurface)]),
    "om_surface_geodesic": (c_int, [POINTER(OmSurface), c_int, c_void_p]),
    "om_surface_init": (c_int, [POINTER(OmSurface), c_int, c_int]),
    "om_surface_load": (c_int, [c_char_p, c_double, POINTER(OmSurface)]),
    "om_surface_load_flags": (c_int, [c_char_p, c_double, c_uint, POINTER(OmSurface)]),
    "om_surface_load_frame": (c_int, [c_char_p, OmMeshFrame, c_uint, POINTER(OmSurface), POINTER(OmMeshFrame)]),
    "om_surface_normals": (None, [POINTER(OmSurface), c_void_p]),
    "om_surface_random_patch": (c_int, [POINTER(OmSurface), c_void_p, c_int, POINTER(OmPatchDef), POINTER(c_void_p), c_void_p]),
    "om_surface_require_closed": (c_int, [POINTER(OmSurface)]),
    "om_surface_sample": (c_int, [POINTER(OmSurface), c_void_p, c_int, POINTER(OmRng), c_void_p, c_void_p]),
    "om_surface_save": (c_int, [POINTER(OmSurface), c_char_p, c_double]),
    "om_surface_save_frame": (c_int, [POINTER(OmSurface), c_char_p, OmMeshFrame]),
    "om_surface_tree_create": (c_int, [POINTER(OmSurface), POINTER(c_void_p)]),
    "om_surface_tree_destroy": (None, [c_void_p]),
    "om_surface_tree_find": (c_bool, [c_void_p, OmVec3, c_void_p, c_double, POINTER(OmSurfacePoint)]),
    "om_surface_tree_find_facing": (c_bool, [c_void_p, OmVec3, OmVec3, c_double, c_void_p, c_double, POINTER(OmSurfacePoint)]),
    "om_surface_tree_move": (None, [c_void_p, c_void_p]),
    "om_surface_volume": (c_double, [POINTER(OmSurface)]),
    "om_team_barrier": (None, [c_void_p]),
    "om_tensor_checksum": (c_uint64, [POINTER(OmTensor), c_int]),
    "om_tensor_count": (c_int64, [POINTER(OmTensor)]),
    "om_tensor_file_check": (c_int, [c_void_p, c_char_p]),
    "om_tensor_file_count": (c_int, [c_void_p]),
    "om_tensor_file_destroy": (None, [c_void_p]),
    "om_tensor_file_find": (c_int, [c_void_p, c_char_p]),
    "om_tensor_file_get": (POINTER(OmTensor), [c_void_p, c_int]),
    "om_tensor_file_load": (c_int, [c_char_p, POINTER(c_void_p)]),
    "om_tensor_file_meta": (c_char_p, [c_void_p, c_char_p]),
    "om_tensor_file_read": (c_int, [c_void_p, c_char_p, c_int, c_void_p, c_void_p]),
    "om_tensor_file_read_double": (c_int, [c_void_p, c_char_p, c_int, c_void_p, c_void_p]),
    "om_tensor_file_save": (c_int, [POINTER(OmTensor), c_int, POINTER(OmTextPair), c_int, c_char_p]),
    "om_tensor_file_setting": (c_int, [c_void_p, c_char_p, c_char_p, c_int, c_int, c_void_p]),
    "om_tet_dihedral": (None, [POINTER(OmTetMesh), c_int, c_void_p, c_void_p]),
    "om_tet_mesh_add_set": (c_int, [POINTER(OmTetMesh), c_char_p, c_void_p, c_int]),
    "om_tet_mesh_boundary": (c_int, [POINTER(OmTetMesh), POINTER(OmSurface), POINTER(c_void_p)]),
    "om_tet_mesh_box": (c_int, [OmVec3, OmVec3, c_int, c_int, c_int, POINTER(OmTetMesh)]),
    "om_tet_mesh_copy": (c_int, [POINTER(OmTetMesh), POINTER(OmTetMesh)]),
    "om_tet_mesh_done": (None, [POINTER(OmTetMesh)]),
    "om_tet_mesh_find_set": (POINTER(OmMeshSet), [POINTER(OmTetMesh), c_char_p]),
    "om_tet_mesh_init": (c_int, [POINTER(OmTetMesh), c_int, c_int]),
    "om_tet_mesh_keep_parts": (c_int, [POINTER(OmTetMesh), c_double, c_void_p, c_void_p]),
    "om_tet_mesh_load": (c_int, [c_char_p, c_double, POINTER(OmTetMesh)]),
    "om_tet_mesh_load_flags": (c_int, [c_char_p, c_double, c_uint, POINTER(OmTetMesh)]),
    "om_tet_mesh_load_frame": (c_int, [c_char_p, OmMeshFrame, c_uint, POINTER(OmTetMesh), POINTER(OmMeshFrame)]),
    "om_tet_mesh_quality": (c_int, [POINTER(OmTetMesh), POINTER(OmMeshQuality)]),
    "om_tet_mesh_refine": (c_int, [POINTER(OmTetMesh)]),
    "om_tet_mesh_save": (c_int, [POINTER(OmTetMesh), c_char_p, c_double]),
    "om_tet_mesh_save_format": (c_int, [POINTER(OmTetMesh), c_char_p, c_double, c_int, POINTER(OmMeshArray), c_int]),
    "om_tet_mesh_save_frame": (c_int, [POINTER(OmTetMesh), c_char_p, OmMeshFrame]),
    "om_tet_mesh_stuff": (c_int, [POINTER(OmStuffDef), POINTER(OmTetMesh)]),
    "om_tet_mesh_validate": (c_int, [POINTER(OmTetMesh)]),
    "om_tet_mesh_volume": (c_double, [POINTER(OmTetMesh)]),
    "om_text_append_base64": (c_int, [POINTER(OmText), c_void_p, c_size_t]),
    "om_text_append_html": (c_int, [POINTER(OmText), c_char_p]),
    "om_text_append_plain": (c_int, [POINTER(OmText), c_char_p, c_size_t]),
    "om_text_append_quoted": (c_int, [POINTER(OmText), c_char_p]),
    "om_text_append_raw": (c_int, [POINTER(OmText), c_char_p, c_size_t]),
    "om_text_done": (None, [POINTER(OmText)]),
    "om_text_is_plain": (c_bool, [c_char_p, c_size_t, c_char_p]),
    "om_text_make_plain": (None, [c_char_p, c_size_t]),
    "om_text_seal": (c_int, [POINTER(OmText)]),
    "om_tissue_add_dv": (None, [c_void_p, c_void_p]),
    "om_tissue_add_force": (None, [c_void_p, c_int, OmVec3, OmMat3]),
    "om_tissue_add_point_force": (c_int, [c_void_p, c_void_p, c_void_p, OmVec3, OmMat3]),
    "om_tissue_anchor": (c_void_p, [c_void_p]),
    "om_tissue_apply": (c_int, [c_void_p, c_void_p, c_int, c_void_p, c_void_p]),
    "om_tissue_attached": (c_void_p, [c_void_p]),
    "om_tissue_attachment_stiffness": (c_void_p, [c_void_p]),
    "om_tissue_begin_step": (c_int, [c_void_p, c_void_p, c_void_p, c_double]),
    "om_tissue_clear_forces": (None, [c_void_p]),
    "om_tissue_contact_force": (c_void_p, [c_void_p]),
    "om_tissue_create": (c_int, [POINTER(OmTissueDef), POINTER(c_void_p)]),
    "om_tissue_default_def": (OmTissueDef, [POINTER(OmTissueEngine), POINTER(OmTetMesh)]),
    "om_tissue_destroy": (None, [c_void_p]),
    "om_tissue_dv": (c_void_p, [c_void_p]),
    "om_tissue_embed": (c_int, [c_void_p, c_int, c_void_p, POINTER(OmEmbedding)]),
    "om_tissue_end_step": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_tissue_engine": (POINTER(OmTissueEngine), [c_void_p]),
    "om_tissue_eval_anchor": (c_int, [c_void_p, c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_tissue_external_force": (c_void_p, [c_void_p]),
    "om_tissue_find_rest": (c_int, [c_void_p, c_void_p, c_void_p, c_double, c_int, POINTER(OmTissueReport)]),
    "om_tissue_get_attachment_force": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_tissue_get_energy": (c_int, [c_void_p, c_void_p, POINTER(OmTissueEnergy)]),
    "om_tissue_get_forces": (c_int, [c_void_p, c_void_p, POINTER(OmTissueForces)]),
    "om_tissue_get_holding_force": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_tissue_get_internal_force": (c_int, [c_void_p, c_void_p, c_void_p]),
    "om_tissue_get_measure": (c_int, [c_void_p, c_void_p, c_int, c_void_p]),
    "om_tissue_get_momentum": (None, [c_void_p, c_void_p, POINTER(OmVec3), POINTER(OmVec3)]),
    "om_tissue_grasp": (c_int, [c_void_p, c_void_p, c_int, OmPose, c_double, c_void_p]),
    "om_tissue_gravity": (OmVec3, [c_void_p]),
    "om_tissue_held_by": (c_void_p, [c_void_p]),
    "om_tissue_is_prescribed": (c_bool, [c_void_p, c_void_p, c_int]),
    "om_tissue_mass": (c_void_p, [c_void_p]),
    "om_tissue_memory": (c_size_t, [c_void_p, c_void_p]),
    "om_tissue_mesh": (POINTER(OmTetMesh), [c_void_p]),
    "om_tissue_move_grasp": (c_int, [c_void_p, c_int, OmPose]),
    "om_tissue_moves_itself": (c_bool, [c_void_p]),
    "om_tissue_nheld": (c_int, [c_void_p, c_int]),
    "om_tissue_release": (None, [c_void_p, c_int]),
    "om_tissue_reserve_points": (c_int, [c_void_p, c_int]),
    "om_tissue_set_attachment": (c_int, [c_void_p, c_void_p, c_int, c_void_p, c_void_p, c_void_p]),
    "om_tissue_set_force_scale": (None, [c_void_p, c_double]),
    "om_tissue_set_tolerance": (None, [c_void_p, c_double]),
    "om_tissue_set_x": (c_int, [c_void_p, c_void_p, c_void_p, c_void_p]),
    "om_tissue_solve": (c_int, [c_void_p, c_void_p, c_int, c_void_p, c_void_p, POINTER(OmSolveInfo)]),
    "om_tissue_solve_step": (c_int, [c_void_p, c_void_p, c_void_p, POINTER(OmTissueReport)]),
    "om_tissue_state_create": (c_int, [c_void_p, POINTER(c_void_p)]),
    "om_tissue_state_destroy": (None, [c_void_p]),
    "om_tissue_state_hash": (c_uint64, [c_void_p]),
    "om_tissue_state_reset": (None, [c_void_p, c_void_p]),
    "om_tissue_state_size": (c_size_t, [c_void_p]),
    "om_tissue_step": (c_int, [c_void_p, c_void_p, c_void_p, c_double, POINTER(OmTissueReport)]),
    "om_tissue_step_among": (c_int, [c_void_p, c_void_p, c_void_p, c_double, c_int, POINTER(OmTissueObstacle), POINTER(OmTissueReport)]),
    "om_tissue_step_with": (c_int, [c_void_p, c_void_p, c_void_p, c_double, OmTissueStepFn, c_void_p, POINTER(OmTissueReport)]),
    "om_tissue_surface_vert": (c_void_p, [c_void_p, c_void_p]),
    "om_tissue_time": (c_double, [c_void_p]),
    "om_tissue_v": (c_void_p, [c_void_p]),
    "om_tissue_vertex_stiffness": (c_double, [c_void_p, c_int]),
    "om_tissue_work_create": (c_int, [c_void_p, POINTER(c_void_p)]),
    "om_tissue_work_destroy": (None, [c_void_p]),
    "om_tissue_x": (c_void_p, [c_void_p]),
    "om_train_default_def": (OmTrainDef, [c_void_p, OmTrainFillFn, c_void_p]),
    "om_train_group_agree": (c_int, [POINTER(OmTrainGroup), c_int]),
    "om_train_group_begin_mpi": (c_int, [POINTER(OmTrainGroup)]),
    "om_train_group_end_mpi": (None, [POINTER(OmTrainGroup)]),
    "om_train_result_done": (None, [POINTER(OmTrainResult)]),
    "om_train_run": (c_int, [POINTER(OmTrainDef), POINTER(OmProgress), c_void_p, POINTER(OmTrainResult)]),
    "om_triangle_closest": (OmVec3, [OmVec3, OmVec3, OmVec3, OmVec3, c_void_p]),
    "om_umesh_data_default_def": (OmUmeshDataDef, [c_void_p, c_char_p]),
    "om_umesh_data_done": (None, [POINTER(OmUmeshData)]),
    "om_umesh_data_load": (c_int, [c_char_p, c_int, POINTER(OmUmeshData)]),
    "om_umesh_engine": (POINTER(OmTissueEngine), []),
    "om_umesh_eval": (c_int, [c_void_p, POINTER(OmUmeshData), c_int, c_int, c_double, c_int, POINTER(OmUmeshEval)]),
    "om_umesh_eval_done": (None, [POINTER(OmUmeshEval)]),
    "om_umesh_find_place": (OmUmeshPatch, [POINTER(OmUmeshGrid), OmVec3]),
    "om_umesh_gather": (None, [POINTER(OmUmeshGrid), c_void_p, c_void_p]),
    "om_umesh_generate": (c_int, [POINTER(OmUmeshDataDef), POINTER(OmProgress), POINTER(OmUmeshSummary)]),
    "om_umesh_grid_done": (None, [POINTER(OmUmeshGrid)]),
    "om_umesh_judge": (None, [c_void_p, c_void_p, c_void_p, POINTER(OmUmeshTrust)]),
    "om_umesh_net_destroy": (None, [c_void_p]),
    "om_umesh_net_fact": (c_char_p, [c_void_p, c_char_p]),
    "om_umesh_net_grid": (POINTER(OmUmeshGrid), [c_void_p]),
    "om_umesh_net_layers": (c_void_p, [c_void_p, POINTER(c_void_p)]),
    "om_umesh_net_load": (c_int, [c_char_p, POINTER(c_void_p)]),
    "om_umesh_net_save_onnx": (c_int, [c_void_p, c_char_p]),
    "om_umesh_organ_create": (c_int, [POINTER(OmUmeshOrganDef), POINTER(c_void_p)]),
    "om_umesh_organ_default_def": (OmUmeshOrganDef, []),
    "om_umesh_organ_destroy": (None, [c_void_p]),
    "om_umesh_organ_grid": (POINTER(OmUmeshGrid), [c_void_p]),
    "om_umesh_organ_surface": (POINTER(OmSurface), [c_void_p]),
    "om_umesh_patch_default": (OmUmeshPatch, [OmVec3, OmVec3, OmVec3]),
    "om_umesh_patch_select": (c_int, [POINTER(OmUmeshGrid), POINTER(OmUmeshPatch), c_void_p]),
    "om_umesh_predict": (c_int, [c_void_p, c_void_p, c_void_p, POINTER(OmUmeshTrust)]),
    "om_umesh_predictor_create": (c_int, [c_void_p, c_int, POINTER(c_void_p)]),
    "om_umesh_predictor_destroy": (None, [c_void_p]),
    "om_umesh_predictor_refinement": (OmFemGridReport, [c_void_p]),
    "om_umesh_predictor_set_linear": (None, [c_void_p, c_bool]),
    "om_umesh_predictor_set_refinement": (None, [c_void_p, c_double, c_int]),
    "om_umesh_record_test": (c_int, [c_void_p, POINTER(OmUmeshData), POINTER(OmUmeshEval), c_char_p]),
    "om_umesh_sample_make": (c_int, [c_void_p, c_int64, POINTER(OmUmeshSample), c_void_p, c_void_p]),
    "om_umesh_scatter": (None, [POINTER(OmUmeshGrid), c_void_p, c_void_p, c_void_p]),
    "om_umesh_solve": (c_int, [c_void_p, c_void_p, c_void_p, POINTER(OmFemReport)]),
    "om_umesh_solver_create": (c_int, [POINTER(OmUmeshDataDef), POINTER(c_void_p)]),
    "om_umesh_solver_destroy": (None, [c_void_p]),
    "om_umesh_train": (c_int, [POINTER(OmUmeshTrainDef), POINTER(OmProgress), POINTER(OmUmeshTrainSummary)]),
    "om_umesh_train_default_def": (OmUmeshTrainDef, [POINTER(OmUmeshData), c_char_p]),
    "om_umesh_untangle": (c_int, [c_void_p, c_void_p, c_void_p, POINTER(OmFemGridUntangling)]),
    "om_unet_create": (c_int, [POINTER(OmUnetDef), POINTER(c_void_p)]),
    "om_unet_default_def": (OmUnetDef, [OmNetShape, c_int]),
    "om_update_default_def": (OmUpdateDef, [POINTER(OmScene), POINTER(OmWorld), POINTER(OmSite)]),
    "om_update_estimate_by_banet": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmProgress), POINTER(OmMatchEstimate)]),
    "om_update_estimate_by_match": (c_int, [c_void_p, c_int, POINTER(OmAcquisition), POINTER(OmProgress), POINTER(OmMatchEstimate)]),
    "om_update_stage_text": (c_char_p, [c_int]),
    "om_updater_create": (c_int, [POINTER(OmUpdateDef), POINTER(c_void_p)]),
    "om_updater_destroy": (None, [c_void_p]),
    "om_utf8_length": (c_size_t, [c_char_p, c_size_t]),
    "om_version": (c_char_p, []),
    "om_view_create": (c_int, [POINTER(OmScene), POINTER(OmSite), POINTER(c_void_p)]),
    "om_view_destroy": (None, [c_void_p]),
    "om_view_look": (c_int, [c_void_p, c_void_p, POINTER(OmVisibility)]),
    "om_volume_count": (c_size_t, [POINTER(OmVolume)]),
    "om_volume_done": (None, [POINTER(OmVolume)]),
    "om_volume_info_done": (None, [POINTER(OmVolumeInfo)]),
    "om_volume_init": (c_int, [POINTER(OmVolume), c_int, c_int, c_int]),
    "om_volume_load": (c_int, [c_char_p, POINTER(OmVolume)]),
    "om_volume_load_entry": (c_int, [c_char_p, c_int, POINTER(OmVolume)]),
    "om_volume_load_info": (c_int, [c_char_p, POINTER(OmVolumeInfo)]),
    "om_volume_load_within": (c_int, [c_char_p, c_int, c_uint64, POINTER(OmVolume)]),
    "om_volume_refuse_dicom": (c_int, [c_char_p]),
    "om_volume_save": (c_int, [POINTER(OmVolume), c_int, c_char_p]),
    "om_volume_value": (c_double, [POINTER(OmVolume), c_size_t]),
    "om_volume_values": (None, [POINTER(OmVolume), c_size_t, c_size_t, c_void_p]),
    "om_voxel_size": (c_size_t, [c_int]),
    "om_window_clip": (OmWindow, [OmWindow, c_int, c_int]),
    "om_words_action": (c_int, [c_void_p, POINTER(OmRetractAction), POINTER(OmText)]),
    "om_words_command": (c_int, [c_void_p, POINTER(OmLoopCommand), POINTER(OmText)]),
    "om_words_end": (c_int, [POINTER(OmRetractResult), POINTER(OmText)]),
    "om_words_force": (c_int, [c_double, POINTER(OmText)]),
    "om_words_hold": (c_int, [c_int, c_char_p, POINTER(OmText)]),
    "om_words_modulus": (c_int, [c_double, c_bool, POINTER(OmText)]),
    "om_words_plan": (c_int, [c_void_p, POINTER(OmSituation), POINTER(OmPlan), POINTER(OmText)]),
    "om_words_update": (c_int, [c_void_p, POINTER(OmUpdateEvent), POINTER(OmText)]),
    "om_words_warning": (c_int, [c_void_p, c_int, POINTER(OmMonitorFrame), POINTER(OmText)]),
    "om_worker_count": (c_int, [c_int]),
    "om_worker_force": (None, [c_bool]),
    "om_worker_free": (c_int, [c_int]),
    "om_worker_is_inside": (c_bool, []),
    "om_world_advance": (c_int, [POINTER(OmWorld), c_double]),
    "om_world_check_visible": (c_int, [POINTER(OmScene), POINTER(OmSite)]),
    "om_world_create_recorded": (c_int, [POINTER(OmWorld), c_char_p, POINTER(POINTER(OmWorld))]),
    "om_world_create_replayed": (c_int, [c_char_p, POINTER(POINTER(OmWorld))]),
    "om_world_create_simulated": (c_int, [POINTER(OmScene), POINTER(OmSite), c_int, POINTER(POINTER(OmWorld))]),
    "om_world_destroy": (None, [POINTER(OmWorld)]),
    "om_world_log_check": (c_int, [c_char_p, POINTER(OmWorldLogInfo)]),
    "om_world_log_end": (c_int, [POINTER(OmWorld)]),
    "om_world_move": (c_int, [POINTER(OmWorld), c_int, OmPose, c_double]),
    "om_world_narm": (c_int, [POINTER(OmWorld)]),
    "om_world_observe": (c_int, [POINTER(OmWorld), c_uint, POINTER(OmObservation)]),
    "om_world_place_psm": (OmPsm, [POINTER(OmSite), c_int]),
    "om_world_place_tip": (OmPose, [POINTER(OmSite), c_int]),
    "om_world_psm": (POINTER(OmPsm), [POINTER(OmWorld), c_int]),
    "om_world_render": (c_int, [POINTER(OmWorld), c_int, c_int, POINTER(OmPicture)]),
    "om_world_reset": (c_int, [POINTER(OmWorld)]),
    "om_world_restore": (c_int, [POINTER(OmWorld), c_void_p]),
    "om_world_save": (c_int, [POINTER(OmWorld), c_void_p]),
    "om_world_set_jaw": (c_int, [POINTER(OmWorld), c_int, c_double]),
    "om_world_set_window": (None, [POINTER(OmWorld), OmWindow]),
    "om_world_sources": (c_uint, [POINTER(OmWorld)]),
    "om_world_state_size": (c_size_t, [POINTER(OmWorld)]),
    "om_world_stop": (None, [POINTER(OmWorld), c_int]),
    "om_world_tool": (POINTER(OmSurface), [POINTER(OmWorld), c_int]),
    "om_world_truth": (c_void_p, [POINTER(OmWorld)]),
    "om_xpbd_engine": (POINTER(OmTissueEngine), []),
    "om_yaml_is_equal": (c_bool, [POINTER(OmYamlField), c_void_p, c_void_p]),
    "om_yaml_load": (c_int, [c_char_p, POINTER(OmYamlSchema), c_void_p]),
    "om_yaml_parse": (c_int, [c_char_p, c_size_t, c_char_p, POINTER(OmYamlSchema), c_void_p]),
    "om_yaml_print": (c_int, [POINTER(OmYamlSchema), c_void_p, POINTER(OmYamlPrint), POINTER(OmText)]),
    "om_yaml_print_keys": (c_int, [POINTER(OmYamlSchema), c_void_p, POINTER(c_char_p), POINTER(OmText)]),
}

# functions whose result is an OmStatus
STATUS = frozenset([
    "om_acquisition_load",
    "om_acquisition_parse",
    "om_acquisition_print_example",
    "om_acquisition_save",
    "om_ahead_create",
    "om_arena_create",
    "om_audit_create",
    "om_banet_advice_intersect",
    "om_banet_cells_expand",
    "om_banet_cells_make",
    "om_banet_data_join",
    "om_banet_data_load",
    "om_banet_estimate",
    "om_banet_eval",
    "om_banet_fuse",
    "om_banet_generate",
    "om_banet_grid_fit",
    "om_banet_intersect",
    "om_banet_intersect_grasps",
    "om_banet_net_find",
    "om_banet_net_load",
    "om_banet_predict",
    "om_banet_predictor_create",
    "om_banet_reliability",
    "om_banet_sample_def_validate",
    "om_banet_sample_make",
    "om_banet_train",
    "om_banet_update",
    "om_banet_updater_create",
    "om_banet_voxelize",
    "om_body_create",
    "om_body_create_shared",
    "om_body_eval_anchor",
    "om_body_find_engine",
    "om_body_find_mesh_factor",
    "om_body_get_attachment_force",
    "om_body_get_forces",
    "om_body_get_measure",
    "om_body_get_vertex_forces",
    "om_body_grasp",
    "om_body_make_tissue_def",
    "om_body_model_create",
    "om_body_move",
    "om_body_set_attachment",
    "om_body_set_force",
    "om_body_set_young",
    "om_body_settle",
    "om_body_step",
    "om_body_step_many",
    "om_body_work_create",
    "om_bsr_create",
    "om_bsr_find_elements",
    "om_bsr_make_exact",
    "om_calibration_path_run",
    "om_calibration_problem_load",
    "om_calibration_run",
    "om_calibration_run_points",
    "om_calibration_save_synthetic",
    "om_calibration_tissue_create",
    "om_calibration_tissue_eval",
    "om_camera_check",
    "om_cloud_field_init",
    "om_cloud_init",
    "om_contact_create",
    "om_contact_settle",
    "om_contact_step",
    "om_contact_surface_make",
    "om_contact_work_create",
    "om_contact_work_move",
    "om_csr_init",
    "om_csr_init_diagonal",
    "om_ct_label",
    "om_ct_make",
    "om_eigen_smallest",
    "om_engine_set_add",
    "om_engine_set_find",
    "om_fem_create",
    "om_fem_dynamics_create",
    "om_fem_eval_contact",
    "om_fem_eval_energy",
    "om_fem_eval_force",
    "om_fem_eval_stable_step",
    "om_fem_eval_stress",
    "om_fem_eval_tangent",
    "om_fem_grid_eval_residual",
    "om_fem_grid_from_sdf",
    "om_fem_grid_init",
    "om_fem_grid_linear_create",
    "om_fem_grid_linear_eval",
    "om_fem_grid_linear_solve",
    "om_fem_grid_make_tet_mesh",
    "om_fem_grid_model_create",
    "om_fem_grid_patch_init",
    "om_fem_grid_solve",
    "om_fem_grid_untangle",
    "om_fem_grid_work_create",
    "om_fem_matrix_create",
    "om_fem_mesh_boundary",
    "om_fem_mesh_box",
    "om_fem_mesh_embed",
    "om_fem_mesh_from_tet",
    "om_fem_mesh_join",
    "om_fem_mesh_validate",
    "om_fem_static_solve",
    "om_fem_statics_create",
    "om_fem_statics_solve",
    "om_fem_step",
    "om_file_begin",
    "om_file_check_ours",
    "om_file_commit",
    "om_file_open",
    "om_file_read",
    "om_file_write",
    "om_folder_begin",
    "om_folder_check",
    "om_folder_commit",
    "om_folder_commit_beside",
    "om_folder_open",
    "om_job_join",
    "om_job_start",
    "om_json_end",
    "om_json_save",
    "om_label_list_load",
    "om_laplacian_init",
    "om_laplacian_init_cloud",
    "om_law_find",
    "om_loop_command",
    "om_loop_command_parse",
    "om_loop_create",
    "om_loop_take_result",
    "om_loop_tick",
    "om_loss_eval",
    "om_mask_choose_parts",
    "om_mask_close",
    "om_mask_crop",
    "om_mask_fill_holes",
    "om_mask_init",
    "om_mask_keep_parts",
    "om_mask_list_parts",
    "om_mat3_inverse",
    "om_match_adoption_begin",
    "om_match_adoption_create",
    "om_match_adoption_follow",
    "om_match_adoption_step",
    "om_match_adoption_stop",
    "om_match_create",
    "om_match_eval",
    "om_match_factorize",
    "om_match_find_pairs",
    "om_match_find_rest",
    "om_match_live_create",
    "om_match_report_save",
    "om_match_report_save_json",
    "om_match_report_save_mesh",
    "om_match_set_young",
    "om_match_solve",
    "om_match_try",
    "om_match_update",
    "om_match_update_with",
    "om_material_validate",
    "om_model_build",
    "om_model_build_volume",
    "om_model_direction",
    "om_model_parse_attach",
    "om_modulus_create",
    "om_monitor_create",
    "om_monitor_frame",
    "om_monitor_try",
    "om_net_create",
    "om_net_describe",
    "om_net_finish",
    "om_net_load",
    "om_net_run_backward",
    "om_net_run_create",
    "om_net_run_forward",
    "om_net_run_set_parameters",
    "om_net_save",
    "om_net_save_onnx",
    "om_optim_create",
    "om_optim_restore",
    "om_optim_step",
    "om_path_check_apart",
    "om_path_dir",
    "om_path_join",
    "om_path_make_dir",
    "om_path_remove",
    "om_path_share",
    "om_patient_add_pictures",
    "om_patient_load",
    "om_patient_save",
    "om_pbd_sample_sdf",
    "om_pbd_sample_sheet",
    "om_pbd_sample_surface",
    "om_picture_encode_png",
    "om_picture_init",
    "om_picture_load_png",
    "om_picture_load_png16",
    "om_picture_save_png",
    "om_picture_save_png16",
    "om_picture_shrink",
    "om_plan_print",
    "om_plan_print_action",
    "om_planner_create",
    "om_planner_explain",
    "om_planner_solve",
    "om_point_cloud_load",
    "om_point_cloud_save",
    "om_point_tree_create",
    "om_preplan_add_maps",
    "om_preplan_load",
    "om_preplan_parse",
    "om_preplan_print",
    "om_preplan_run",
    "om_preplan_save",
    "om_preplan_save_report",
    "om_press_create",
    "om_press_move",
    "om_press_place",
    "om_press_step",
    "om_probe_create",
    "om_probe_get_surface",
    "om_progress_report",
    "om_psm_inverse",
    "om_psm_inverse_turned",
    "om_psm_load_instrument",
    "om_psm_parse_instrument",
    "om_psm_surface",
    "om_recorder_create",
    "om_recording_add_step",
    "om_recording_begin",
    "om_recording_begin_scene",
    "om_recording_end",
    "om_report_save",
    "om_retract_calibrate_force",
    "om_retract_check",
    "om_retract_replay",
    "om_retract_run",
    "om_retract_search",
    "om_retract_search_both",
    "om_rl_actor_act",
    "om_rl_actor_create",
    "om_rl_actor_update",
    "om_rl_demos_check",
    "om_rl_demos_load",
    "om_rl_demos_parse",
    "om_rl_demos_record",
    "om_rl_demos_save",
    "om_rl_drive_create",
    "om_rl_drive_info",
    "om_rl_drive_keep",
    "om_rl_drive_render",
    "om_rl_drive_reset",
    "om_rl_drive_step",
    "om_rl_eval_run",
    "om_rl_policy_check",
    "om_rl_policy_create",
    "om_rl_policy_load",
    "om_rl_policy_save",
    "om_rl_policy_save_onnx",
    "om_rl_retract_create",
    "om_rl_retract_survey",
    "om_rl_task_create",
    "om_rl_trace_follow",
    "om_rl_trace_load",
    "om_rl_trace_parse",
    "om_rl_train_run",
    "om_rl_vec_create",
    "om_rl_vec_expert",
    "om_rl_vec_info",
    "om_rl_vec_render",
    "om_rl_vec_reset",
    "om_rl_vec_reset_one",
    "om_rl_vec_restore",
    "om_rl_vec_step",
    "om_roi_meter_create",
    "om_roi_meter_look",
    "om_roi_visibility",
    "om_scan_check",
    "om_scan_check_model",
    "om_scan_from_observation",
    "om_scan_init",
    "om_scan_learn_range",
    "om_scan_load",
    "om_scan_register",
    "om_scan_save",
    "om_scene_load",
    "om_scene_parse",
    "om_scene_print",
    "om_scene_print_example",
    "om_scene_print_keys",
    "om_sdf_from_function",
    "om_sdf_from_mask",
    "om_sdf_from_surface",
    "om_sense_count_visible",
    "om_sense_depth",
    "om_sense_render",
    "om_sense_scene_add",
    "om_sense_scene_commit",
    "om_sense_scene_create",
    "om_sense_triangles",
    "om_sense_visibility",
    "om_series_append",
    "om_series_append_stereo",
    "om_series_begin",
    "om_series_get_frame",
    "om_series_load",
    "om_series_parse",
    "om_site_build",
    "om_site_scale_attachments",
    "om_solver_create",
    "om_solver_refresh",
    "om_solver_refresh_diagonal",
    "om_solver_solve",
    "om_solver_solve_gmres",
    "om_spectral_basis_init",
    "om_spectral_basis_init_part",
    "om_spectral_basis_init_scan",
    "om_spectral_get_matrix",
    "om_spectral_map_from_landmarks",
    "om_spectral_map_from_matrix",
    "om_spectral_map_from_nearest",
    "om_spectral_map_to_surface",
    "om_spectral_zoomout",
    "om_stereo_depth",
    "om_stereo_rectify",
    "om_store_begin",
    "om_store_check_array",
    "om_store_get_array",
    "om_store_get_records",
    "om_store_get_shape",
    "om_store_get_value",
    "om_store_open",
    "om_store_save",
    "om_store_shard_path",
    "om_surface_check",
    "om_surface_check_closed",
    "om_surface_from_sdf",
    "om_surface_geodesic",
    "om_surface_init",
    "om_surface_load",
    "om_surface_load_flags",
    "om_surface_load_frame",
    "om_surface_random_patch",
    "om_surface_require_closed",
    "om_surface_sample",
    "om_surface_save",
    "om_surface_save_frame",
    "om_surface_tree_create",
    "om_tensor_file_check",
    "om_tensor_file_load",
    "om_tensor_file_read",
    "om_tensor_file_read_double",
    "om_tensor_file_save",
    "om_tensor_file_setting",
    "om_tet_mesh_add_set",
    "om_tet_mesh_boundary",
    "om_tet_mesh_box",
    "om_tet_mesh_copy",
    "om_tet_mesh_init",
    "om_tet_mesh_keep_parts",
    "om_tet_mesh_load",
    "om_tet_mesh_load_flags",
    "om_tet_mesh_load_frame",
    "om_tet_mesh_quality",
    "om_tet_mesh_refine",
    "om_tet_mesh_save",
    "om_tet_mesh_save_format",
    "om_tet_mesh_save_frame",
    "om_tet_mesh_stuff",
    "om_tet_mesh_validate",
    "om_text_append_base64",
    "om_text_append_html",
    "om_text_append_plain",
    "om_text_append_quoted",
    "om_text_append_raw",
    "om_text_seal",
    "om_tissue_add_point_force",
    "om_tissue_apply",
    "om_tissue_begin_step",
    "om_tissue_create",
    "om_tissue_embed",
    "om_tissue_end_step",
    "om_tissue_eval_anchor",
    "om_tissue_find_rest",
    "om_tissue_get_attachment_force",
    "om_tissue_get_energy",
    "om_tissue_get_forces",
    "om_tissue_get_holding_force",
    "om_tissue_get_internal_force",
    "om_tissue_get_measure",
    "om_tissue_grasp",
    "om_tissue_move_grasp",
    "om_tissue_reserve_points",
    "om_tissue_set_attachment",
    "om_tissue_set_x",
    "om_tissue_solve",
    "om_tissue_solve_step",
    "om_tissue_state_create",
    "om_tissue_step",
    "om_tissue_step_among",
    "om_tissue_step_with",
    "om_tissue_work_create",
    "om_train_group_agree",
    "om_train_group_begin_mpi",
    "om_train_run",
    "om_umesh_data_load",
    "om_umesh_eval",
    "om_umesh_generate",
    "om_umesh_net_load",
    "om_umesh_net_save_onnx",
    "om_umesh_organ_create",
    "om_umesh_predict",
    "om_umesh_predictor_create",
    "om_umesh_record_test",
    "om_umesh_sample_make",
    "om_umesh_solve",
    "om_umesh_solver_create",
    "om_umesh_train",
    "om_umesh_untangle",
    "om_unet_create",
    "om_update_estimate_by_banet",
    "om_update_estimate_by_match",
    "om_updater_create",
    "om_view_create",
    "om_view_look",
    "om_volume_init",
    "om_volume_load",
    "om_volume_load_entry",
    "om_volume_load_info",
    "om_volume_load_within",
    "om_volume_refuse_dicom",
    "om_volume_save",
    "om_words_action",
    "om_words_command",
    "om_words_end",
    "om_words_force",
    "om_words_hold",
    "om_words_modulus",
    "om_words_plan",
    "om_words_update",
    "om_words_warning",
    "om_world_advance",
    "om_world_check_visible",
    "om_world_create_recorded",
    "om_world_create_replayed",
    "om_world_create_simulated",
    "om_world_log_check",
    "om_world_log_end",
    "om_world_move",
    "om_world_observe",
    "om_world_render",
    "om_world_reset",
    "om_world_restore",
    "om_world_save",
    "om_world_set_jaw",
    "om_yaml_load",
    "om_yaml_parse",
    "om_yaml_print",
    "om_yaml_print_keys",
])
