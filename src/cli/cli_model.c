// cli_model.c: omentum model: from a volume or a mesh to a patient model.
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "cli_model.h"

static const OmCliOption option[] = {
    {"--list", NULL, NULL, "list the labels or segments of INPUT and end; needs no -o"},
    {"--label", "-l", "N|NAME[,...]",
     "labels whose union is meshed, by number or name, or \"all\"; may be repeated"},
    {"--threshold", NULL, "SHARE",
     "of an interpolated label map: a voxel belongs to the label from this share on, as 0.5",
     "none", NULL, 0, 1},
    {"--volume", NULL, "N", "index of the volume in a file of several (times, components), from 0",
     NULL, NULL, 0, 1 << 30},
    {"--window", NULL, "LO,HI", "intensities from LO to HI instead of labels"},
    {"--edge", "-e", "MM", "mean edge of the tetrahedra", "4", "mm", 0.01, 1000},
    {"--part", NULL, "N[,N...]", "connected parts to keep; 1 is the largest", "1"},
    {"--all-parts", NULL, NULL, "keep every part of at least --min-share, not only the largest"},
    {"--min-share", NULL, "PERCENT", "smallest part that --all-parts keeps", "1", "%", 0, 100},
    {"--connectivity", NULL, "6|26", "which voxels are connected", "6", NULL, 6, 26},
    {"--keep-holes", NULL, NULL, "do not fill holes inside the organ"},
    {"--close", NULL, "MM", "morphological closing by a ball of this radius", "0", "mm", 0, 100},
    {"--smooth", NULL, "VOXELS", "width of the smoothing that keeps volumes", "1.2", "voxels", 0.5,
     3},
    {"--no-bending", NULL, NULL, "leave out the bending test of the mesh, 0.5 to 1 s"},
    {"--no-refine", NULL, NULL, "keep the edge length also where parts are thinner"},
    {"--allow-loss", NULL, NULL, "exit code 0 also where the mesh does not hold all of the label"},
    {"--remesh", NULL, NULL, "remesh a volume mesh instead of using its elements"},
    {"--repair", NULL, NULL,
     "mend a surface also where many triangles are damaged, and fill large holes"},
    {"--strict", NULL, NULL, "refuse a surface or mesh with a defect instead of mending it"},
    {"--keep-cracks", NULL, NULL,
     "leave faces of a volume mesh apart whose vertices coincide, instead of welding them"},
    {"--unit", NULL, "mm|cm|m", "unit of the file's lengths", "the file's unit, else mm"},
    {"--space", NULL, "ras|lps",
     "space of the file's coordinates, instead of the space that it states", "RAS"},
    {"--export-space", NULL, "ras|lps", "space of the tissue.vtu and organ.ply written", "ras"},
    {"--sheet", NULL, "KEY=VALUE,...",
     "cover a side with fat: thickness, side, gap, bridge, length, width, corner, wrap (mm)"},
    {"--tumour", NULL, "KEY=VALUE,...",
     "on the organ under the sheet: radius, height, along, across (mm), points"},
    {"--attach", NULL, "FACE[:WHERE]",
     "attach the sheet, or the tissue of --over, at: border, underside or top; may be repeated"},
    {"--over", NULL, "KEY=VALUE,...",
     "the label is tissue on an organ in the same volume: organ (labels, as 2/3), roi, side, reach (mm), points"},
    {"--material", NULL, "KEY=VALUE,...",
     "name, label, young (Pa), poisson, density; may be repeated"},
    {"--max-volume", NULL, "GB", "largest size of a volume's voxels", "1.07", "GB", 1e-3, 64},
    {"--name", NULL, "NAME", "name of the model", "that of the file"},
    {"--output", "-o", "DIR", "folder of the model; replaces an older model there"},
    {"--workers", "--threads", "N", "threads", "one per processor; the mesh does not depend on it",
     NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress bar"},
};

static const OmCliKey result_key[] = {
    {"tetrahedra", "tetrahedra of the mesh"},
    {"vertices", "vertices of the mesh"},
    {"edge_smallest_mm", "length of edges"},
    {"edge_mean_mm", "length of edges"},
    {"edge_largest_mm", "length of edges"},
    {"volume_ml", "volume of the mesh"},
    {"surface_error_mm", "mean distance to the input's surface"},
    {"label_to_mesh_95_mm", "95 % of the label's surface are nearer to the mesh"},
    {"label_to_mesh_largest_mm", "largest distance of the label's surface from the mesh"},
    {"mesh_to_label_95_mm", "95 % of the mesh's surface are nearer to the label"},
    {"mesh_to_label_largest_mm", "largest distance of the mesh's surface from the label"},
    {"missing_ml", "of the label, not in the mesh"},
    {"too_much_ml", "of the mesh, not in the label"},
    {"bending_error_percent", "what quadratic elements lack of a bending deflection"},
};

// ---- words to numbers --------------------------------------------------------------------------------------

static OmStatus parse_number(const char* what, const char* text, double* value) {
    char* end;
    *value = strtod(text, &end);
    OM_CHECK(end != text && *end == 0 && isfinite(*value), OM_INVALID, "%s: \"%s\" is not a number",
             what, text);
    return OM_OK;
}

// Cut `list` at `separator` into words of `buffer`; returns their number, or -1 if too many or too long.
static int split(const char* list, char separator, char* buffer, size_t size, char** word,
                 int max) {
    if (strlen(list) >= size) return -1;
    memcpy(buffer, list, strlen(list) + 1);
    int n = 0;
    for (char* at = buffer; at; n++) {
        if (n == max) return -1;
        word[n] = at;
        at = strchr(at, separator);
        if (at) *at++ = 0;
    }
    return n;
}

static bool is_whole_number(const char* word, int* number) {
    char* end;
    double value = strtod(word, &end);
    bool is_whole = end != word && *end == 0 && value == floor(value) && fabs(value) < 1e9;
    *number = is_whole ? (int)value : 0;
    return is_whole;
}

// Read numbers, names, or "all".
static OmStatus parse_labels(const OmCliArgs* args, OmModelDef* def) {
    const char* list;
    for (int k = 0; (list = om_cli_get_nth(args, "--label", k)) != NULL; k++) {
        char buffer[1024];
        char* word[OM_MAX_LABEL];
        int n = split(list, ',', buffer, sizeof buffer, word, OM_MAX_LABEL);
        OM_CHECK(n > 0 && def->nlabel + def->nlabel_name + n <= OM_MAX_LABEL, OM_INVALID,
                 "--label: at most %d labels", OM_MAX_LABEL);
        for (int i = 0; i < n; i++) {
            int number;
            OM_CHECK(word[i][0] && strlen(word[i]) < OM_SEGMENT_NAME, OM_INVALID,
                     "--label: \"%s\" is neither a number nor a name", word[i]);
            if (is_whole_number(word[i], &number))
                def->label[def->nlabel++] = number;
            else if (strcmp(word[i], "all") == 0)
                def->all_labels = true;
            else
                memcpy(def->label_name[def->nlabel_name++], word[i], strlen(word[i]) + 1);
        }
    }
    OM_CHECK(!def->all_labels || def->nlabel + def->nlabel_name == 0, OM_INVALID,
             "--label: \"all\" excludes other labels");
    return OM_OK;
}

static OmStatus parse_parts(const OmCliArgs* args, OmModelDef* def) {
    const char* text = om_cli_get(args, "--part");
    if (!text) return OM_OK;
    char buffer[256];
    char* word[OM_MAX_PART];
    int n = split(text, ',', buffer, sizeof buffer, word, OM_MAX_PART);
    OM_CHECK(n > 0, OM_INVALID, "--part: at most %d parts", OM_MAX_PART);
    for (int i = 0; i < n; i++) {
        OM_CHECK(is_whole_number(word[i], &def->part[i]) && def->part[i] > 0, OM_INVALID,
                 "--part: \"%s\" is not the number of a part; 1 is the largest", word[i]);
    }
    def->npart = n;
    OM_CHECK(!om_cli_get(args, "--all-parts"), OM_INVALID,
             "--part and --all-parts exclude each other");
    return OM_OK;
}

static OmStatus parse_window(const OmCliArgs* args, OmModelDef* def) {
    const char* text = om_cli_get(args, "--window");
    if (!text) return OM_OK;
    char buffer[128];
    char* word[2];
    OM_CHECK(split(text, ',', buffer, sizeof buffer, word, 2) == 2, OM_INVALID,
             "--window: \"%s\" is not of the form LO,HI", text);
    OM_CHECK(def->nlabel + def->nlabel_name == 0 && !def->all_labels, OM_INVALID,
             "--window and --label exclude each other");
    OM_TRY(parse_number("--window", word[0], &def->window_lo));
    OM_TRY(parse_number("--window", word[1], &def->window_hi));
    def->has_window = true;
    return OM_OK;
}

typedef struct Key {
    const char* name;
    double* number;  // receives scale times the value, or
    char* text;      // receives the words, with / turned into , so that x/y/z can stand in a list
    size_t size;
    double scale;
} Key;

// KEY=VALUE,KEY=VALUE...
static OmStatus parse_pairs(const char* verb, const char* list, const Key* key, int nkey) {
    char buffer[1024];
    char* word[32];
    int n = split(list, ',', buffer, sizeof buffer, word, 32);
    OM_CHECK(n > 0, OM_INVALID, "%s: too many words", verb);
    for (int i = 0; i < n; i++) {
        char* value = strchr(word[i], '=');
        OM_CHECK(value, OM_INVALID, "%s: \"%s\" is not of the form KEY=VALUE", verb, word[i]);
        *value++ = 0;
        const Key* found = NULL;
        const char* names[32];
        for (int k = 0; k < nkey; k++) {
            names[k] = key[k].name;
            if (strcmp(word[i], key[k].name) == 0) found = &key[k];
        }
        const char* near = om_nearest_word(word[i], names, nkey);
        OM_CHECK(found, OM_INVALID, "%s: unknown key \"%s\"%s%s%s", verb, word[i],
                 near ? "; did you mean \"" : "", near ? near : "", near ? "\"?" : "");
        if (found->text) {
            OM_CHECK(strlen(value) < found->size, OM_INVALID, "%s: \"%s\" is too long", verb,
                     value);
            for (char* c = value; *c; c++) *c = *c == '/' ? ',' : *c;
            memcpy(found->text, value, strlen(value) + 1);
        } else {
            char what[64];
            snprintf(what, sizeof what, "%s: %s", verb, found->name);
            OM_TRY(parse_number(what, value, found->number));
            *found->number *= found->scale;
        }
    }
    return OM_OK;
}

// ---- the def --------------------------------------------------------------------------------------------------

static OmStatus parse_over(const OmCliArgs* args, OmModelDef* def) {
    OmOverDef* o = &def->over;
    char organ[256] = "", buffer[256];
    char* word[OM_MAX_LABEL];
    double points = o->nroi, roi = o->roi;
    const Key key[] = {
        {"organ", NULL, organ, sizeof organ, 1},
        {"roi", &roi, NULL, 0, 1},
        {"side", NULL, o->side, sizeof o->side, 1},
        {"reach", &o->reach, NULL, 0, 1e-3},
        {"points", &points, NULL, 0, 1},
    };
    const char* list = om_cli_get(args, "--over");
    if (!list) return OM_OK;
    OM_TRY(parse_pairs("--over", list, key, 5));
    OM_CHECK(organ[0], OM_INVALID, "--over: organ is missing: the labels below, as organ=2/3");
    int n = split(organ, ',', buffer, sizeof buffer, word, OM_MAX_LABEL);
    OM_CHECK(n > 0, OM_INVALID, "--over: organ: at most %d labels", OM_MAX_LABEL);
    for (int i = 0; i < n; i++)
        OM_CHECK(is_whole_number(word[i], &o->label[o->nlabel++]), OM_INVALID,
                 "--over: organ: \"%s\" is not the number of a label", word[i]);
    OM_CHECK(roi == floor(roi) && roi >= -1 && roi < 1e9, OM_INVALID,
             "--over: roi %g is not the number of a label", roi);
    OM_CHECK(points >= 1 && points <= 20000 && points == floor(points), OM_INVALID,
             "--over: points %g must be 1 to 20000", points);
    o->roi = (int)roi;
    o->nroi = (int)points;
    const char* attach;
    for (int k = 0; (attach = om_cli_get_nth(args, "--attach", k)) != NULL; k++) {
        OM_CHECK(k < OM_MAX_ATTACH, OM_INVALID, "--attach: at most %d", OM_MAX_ATTACH);
        OM_TRY(om_model_parse_attach(attach, &o->attach[o->nattach++]));
    }
    return OM_OK;
}

static OmStatus parse_sheet(const OmCliArgs* args, OmModelDef* def) {
    OmSheetDef* s = &def->sheet;
    double points = s->nroi;
    const Key sheet_key[] = {
        {"thickness", &s->thickness, NULL, 0, 1e-3},
        {"side", NULL, s->side, sizeof s->side, 1},
        {"gap", &s->gap, NULL, 0, 1e-3},
        {"bridge", &s->bridge, NULL, 0, 1e-3},
        {"length", &s->half_length, NULL, 0, 5e-4},
        {"width", &s->half_width, NULL, 0, 5e-4},
        {"corner", &s->corner, NULL, 0, 1e-3},
        {"wrap", &s->wrap, NULL, 0, 1e-3},
    };
    const Key tumour_key[] = {
        {"radius", &s->tumour_radius, NULL, 0, 1e-3},
        {"height", &s->tumour_height, NULL, 0, 1e-3},
        {"along", &s->tumour_shift[0], NULL, 0, 1e-3},
        {"across", &s->tumour_shift[1], NULL, 0, 1e-3},
        {"points", &points, NULL, 0, 1},
    };
    const char* sheet = om_cli_get(args, "--sheet");
    const char* tumour = om_cli_get(args, "--tumour");
    const char* attach = om_cli_get(args, "--attach");
    const bool is_over = om_cli_get(args, "--over") != NULL;
    OM_CHECK(!sheet || !is_over, OM_INVALID, "--sheet and --over exclude each other");
    OM_CHECK(sheet || (!tumour && (!attach || is_over)), OM_INVALID, "%s needs --sheet",
             tumour ? "--tumour" : "--attach");
    if (is_over) return parse_over(args, def);
    if (!sheet) return OM_OK;
    OM_TRY(parse_pairs("--sheet", sheet, sheet_key, 8));
    OM_CHECK(s->thickness > 0, OM_INVALID, "--sheet: thickness (mm) is missing or not positive");
    if (tumour) OM_TRY(parse_pairs("--tumour", tumour, tumour_key, 5));
    OM_CHECK(points >= 1 && points <= 20000 && points == floor(points), OM_INVALID,
             "--tumour: points %g must be 1 to 20000", points);
    s->nroi = (int)points;
    for (int k = 0; (attach = om_cli_get_nth(args, "--attach", k)) != NULL; k++) {
        OM_CHECK(k < OM_MAX_ATTACH, OM_INVALID, "--attach: at most %d", OM_MAX_ATTACH);
        OM_TRY(om_model_parse_attach(attach, &s->attach[s->nattach++]));
    }
    return OM_OK;
}

static OmStatus parse_materials(const OmCliArgs* args, OmModelDef* def) {
    const char* list;
    for (int k = 0; (list = om_cli_get_nth(args, "--material", k)) != NULL; k++) {
        OM_CHECK(k < OM_MAX_MATERIAL, OM_INVALID, "--material: at most %d", OM_MAX_MATERIAL);
        OmPatientMaterial* m = &def->material[def->nmaterial++];
        *m = (OmPatientMaterial){.poisson = 0.45, .density = 1000};
        double label = -1;
        const Key key[] = {
            {"name", NULL, m->name, sizeof m->name, 1}, {"label", &label, NULL, 0, 1},
            {"young", &m->young, NULL, 0, 1},           {"poisson", &m->poisson, NULL, 0, 1},
            {"density", &m->density, NULL, 0, 1},
        };
        OM_TRY(parse_pairs("--material", list, key, 5));
        OM_CHECK(label >= -1 && label < 1e9 && label == floor(label), OM_INVALID,
                 "--material: label %g is not a whole number", label);
        OM_CHECK(m->young > 0, OM_INVALID, "--material: young (Pa) is missing or not positive");
        m->label = (int)label;
        if (!m->name[0]) snprintf(m->name, sizeof m->name, "tissue %d", k + 1);
    }
    return OM_OK;
}

static OmStatus parse_space(const OmCliArgs* args, const char* name, OmSpace* space) {
    const char* word = om_cli_get(args, name);
    if (!word) return OM_OK;
    bool is_lps = strcasecmp(word, "lps") == 0;
    OM_CHECK(is_lps || strcasecmp(word, "ras") == 0, OM_INVALID,
             "%s: \"%s\" is neither ras nor lps", name, word);
    *space = is_lps ? OM_SPACE_LPS : OM_SPACE_RAS;
    return OM_OK;
}

static OmStatus parse_def(const OmCliArgs* args, const char* input, OmModelDef* def) {
    double edge = 4, share = 1, close = 0, gb = 1e-9 * (double)OM_VOLUME_MAX_SIZE;
    const char* unit = om_cli_get(args, "--unit");
    const char* name = om_cli_get(args, "--name");
    OM_CHECK(strlen(input) < sizeof def->input, OM_INVALID, "the input's name is too long");
    OM_TRY(om_cli_double(args, "--edge", &edge));
    *def = om_model_default_def(input, edge * 1e-3);
    OM_TRY(parse_labels(args, def));
    OM_TRY(parse_window(args, def));
    OM_TRY(parse_parts(args, def));
    OM_TRY(om_cli_int(args, "--volume", &def->volume));
    OM_TRY(om_cli_double(args, "--min-share", &share));
    OM_TRY(om_cli_double(args, "--close", &close));
    OM_TRY(om_cli_double(args, "--threshold", &def->threshold));
    OM_TRY(om_cli_double(args, "--smooth", &def->smooth));
    OM_TRY(om_cli_int(args, "--connectivity", &def->connectivity));
    OM_TRY(om_cli_int(args, "--workers", &def->nworker));
    OM_TRY(om_cli_double(args, "--max-volume", &gb));
    def->max_volume_size = (uint64_t)(gb * 1e9);
    def->min_share = share / 100;
    def->close_radius = close * 1e-3;
    def->keep_all = om_cli_get(args, "--all-parts") != NULL;
    def->keep_holes = om_cli_get(args, "--keep-holes") != NULL;
    def->remesh = om_cli_get(args, "--remesh") != NULL;
    OM_CHECK(!om_cli_get(args, "--repair") || !om_cli_get(args, "--strict"), OM_INVALID,
             "--repair and --strict exclude each other");
    if (om_cli_get(args, "--repair")) def->repair = OM_REPAIR_ALL;
    if (om_cli_get(args, "--strict")) def->repair = OM_REPAIR_STRICT;
    def->keep_cracks = om_cli_get(args, "--keep-cracks") != NULL;
    def->refine = om_cli_get(args, "--no-refine") == NULL;
    def->allow_loss = om_cli_get(args, "--allow-loss") != NULL;
    def->has_bending_test = om_cli_get(args, "--no-bending") == NULL;
    if (unit) {
        bool is_m = strcmp(unit, "m") == 0, is_cm = strcmp(unit, "cm") == 0;
        OM_CHECK(is_m || is_cm || strcmp(unit, "mm") == 0, OM_INVALID,
                 "--unit: \"%s\" is none of mm, cm, m", unit);
        def->unit = is_m ? 1 : is_cm ? 0.01 : 0.001;
    }
    OM_TRY(parse_space(args, "--space", &def->space));
    if (name) {
        OM_CHECK(strlen(name) < sizeof def->name, OM_INVALID, "--name: \"%s\" is too long", name);
        memcpy(def->name, name, strlen(name) + 1);
    }
    OM_TRY(parse_sheet(args, def));
    return parse_materials(args, def);
}

// ---- the verb ---------------------------------------------------------------------------------------------------

void om_cli_model_notes(const OmModelReport* r) {
    for (const char* line = r->note; *line;) {
        const char* end = line + strcspn(line, "\n");
        printf("note: %.*s\n", (int)(end - line), line);
        line = *end ? end + 1 : end;
    }
    if (r->warning[0]) printf("note: %s\n", r->warning);
}

static void print_gap(const char* name, const OmSurfaceGap* gap) {
    printf("%s: %.2f mm (mean), %.2f (95 %%), %.2f (largest, at %.1f, %.1f, %.1f)\n", name,
           gap->mean * 1e3, gap->p95 * 1e3, gap->max * 1e3, gap->where.x * 1e3, gap->where.y * 1e3,
           gap->where.z * 1e3);
}

static void print_fit(const OmModelReport* r) {
    const OmTopology* m = &r->fit.mesh;
    const char* of = r->fit_is_of_sheet ? "sheet" : "input";
    char name[64];
    snprintf(name, sizeof name, "from the surface of the %s to the mesh", of);
    print_gap(name, &r->fit.to_mesh);
    snprintf(name, sizeof name, "from the surface of the mesh to the %s", of);
    print_gap(name, &r->fit.to_solid);
    om_cli_figure("label_to_mesh_95_mm", r->fit.to_mesh.p95 * 1e3);
    om_cli_figure("label_to_mesh_largest_mm", r->fit.to_mesh.max * 1e3);
    om_cli_figure("mesh_to_label_95_mm", r->fit.to_solid.p95 * 1e3);
    om_cli_figure("mesh_to_label_largest_mm", r->fit.to_solid.max * 1e3);
    om_cli_figure("missing_ml", r->fit.lost * 1e6);
    om_cli_figure("too_much_ml", r->fit.added * 1e6);
    if (om_topology_is_equal(&r->fit.solid, m))
        printf("%d part%s, %d handle%s, %d cavit%s, as the %s\n", m->npart,
               m->npart == 1 ? "" : "s", m->nhandle, m->nhandle == 1 ? "" : "s", m->ncavity,
               m->ncavity == 1 ? "y" : "ies", of);
}

static void print_summary(const OmPatient* p, const OmModelReport* r, const char* dir) {
    const OmMeshQuality* q = &r->quality;
    const double deg = 180 / 3.14159265358979;
    if (r->selected[0]) {
        printf("%s: %lld voxels of %.3g x %.3g x %.3g mm, %.2f mL in %d part%s\n", r->selected,
               (long long)r->nvoxel, r->voxel.x * 1e3, r->voxel.y * 1e3, r->voxel.z * 1e3,
               r->label_volume * 1e6, r->npart_mask, r->npart_mask == 1 ? "" : "s");
    }
    printf(
        "%s: %d tetrahedra, %d vertices, edges %.2f mm (smallest), %.2f (mean), %.2f (largest)\n",
        p->name, q->ntet, q->nvert, q->edge_min * 1e3, q->edge_mean * 1e3, q->edge_max * 1e3);
    om_cli_figure("tetrahedra", q->ntet);
    om_cli_figure("vertices", q->nvert);
    om_cli_figure("edge_smallest_mm", q->edge_min * 1e3);
    om_cli_figure("edge_mean_mm", q->edge_mean * 1e3);
    om_cli_figure("edge_largest_mm", q->edge_max * 1e3);
    om_cli_figure("volume_ml", q->volume * 1e6);
    om_cli_figure("surface_error_mm", r->surface_error_mean * 1e3);
    om_cli_figure("bending_error_percent", 100 * r->bending_error);
    om_cli_path(dir);
    printf("dihedral angles %.1f (smallest) to %.1f (largest) degrees; ", q->dihedral_min * deg,
           q->dihedral_max * deg);
    if (p->organ.ntri > 0)  // the mesh is the sheet, the label is the organ below
        printf("volume %.2f mL, %.2f %% off, the organ's %.2f mL", q->volume * 1e6,
               r->volume_error * 100, r->surface_volume * 1e6);
    else
        printf("volume %.2f mL", q->volume * 1e6);
    if (r->label_volume > 0)
        printf(", %+.2f %% of the whole label", r->label_error * 100);
    else if (p->organ.ntri == 0)
        printf(", %.2f %% off", r->volume_error * 100);
    printf("; surface %.2f mm off (mean)\n", r->surface_error_mean * 1e3);
    if (!isnan(r->bending_error))
        printf("bending error of this mesh: %.1f %%\n", 100 * r->bending_error);
    for (int s = 0; s < p->mesh.nset; s++) {
        printf("%s%s %d", s ? ", " : "sets: ", p->mesh.set[s].name, p->mesh.set[s].nvert);
    }
    if (p->mesh.nset) printf(" vertices; region of interest: %d points\n", p->nroi);
    if (r->has_fit) print_fit(r);
    om_cli_model_notes(r);
    printf("%s: written in %.1f s; open report.html\n", dir, r->seconds);
}

static void print_line(void* ctx, const char* line) {
    (void)ctx;
    printf("dcm2niix: %s\n", line);
}

// A DICOM series is converted into a temporary folder, from which the model is built.
static OmStatus take_dicom(const char* input, OmModelDef* def, OmDicomSeries* series) {
    memset(series, 0, sizeof *series);
    if (!om_dicom_is_there(input)) return OM_OK;
    OM_TRY(om_dicom_convert(input, print_line, NULL, series));
    const bool is_short =
        snprintf(def->input, sizeof def->input, "%s", series->path) < (int)sizeof def->input;
    if (!def->name[0] || def->name[0] == '.') snprintf(def->name, sizeof def->name, "dicom");
    if (!is_short) om_dicom_done(series);
    return is_short ? OM_OK : om_error(OM_INVALID, "%s: the path is too long", input);
}

// A model that loses something is written, too, with a report that shows where; the exit code tells.
static int build(const OmModelDef* asked, OmSpace export_space, bool is_quiet, const char* dir) {
    OmPatient patient;
    OmModelReport report;
    OmModelDef def = *asked;
    def.allow_loss = true;
    const OmProgress* progress = om_cli_progress(is_quiet);
    OmStatus status = om_model_build(&def, progress, &patient, &report);
    if (status < 0) return om_cli_fail("model", status);
    patient.file_space = export_space;
    status = om_progress_report(progress, "writing", 0, 1);
    if (status == OM_OK) status = om_patient_save(&patient, &report, dir);
    if (status == OM_OK) {
        om_cli_progress_done();
        print_summary(&patient, &report, dir);
        if (export_space == OM_SPACE_LPS)
            printf(
                "tissue.vtu and organ.ply are in LPS and state it; patient.yaml is always in RAS\n");
    }
    om_patient_done(&patient);
    if (status < 0) return om_cli_fail("model", status);
    if (!report.has_loss) return OM_EXIT_OK;
    char text[1024];
    om_model_describe_loss(&report, text, sizeof text);
    fprintf(stderr, "omentum model: %s%s\n", text,
            asked->allow_loss ? "" : ", or add --allow-loss");
    return asked->allow_loss ? OM_EXIT_OK : OM_EXIT_FAILED;
}

int om_cli_model(int argc, char** argv) {
    const OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    OmStatus status = om_cli_check(&args, 1, &npositional);
    const char* input = status == OM_OK ? om_cli_positional(&args, 0) : NULL;
    const char* dir = status == OM_OK ? om_cli_get(&args, "--output") : NULL;
    const bool is_list = status == OM_OK && om_cli_get(&args, "--list");
    OmModelDef def;
    if (status == OM_OK && !input)
        status = om_error(OM_INVALID, "no volume or mesh is given; see --help");
    if (status == OM_OK && is_list && dir)
        status = om_error(OM_INVALID, "--list writes nothing: leave out -o");
    if (status == OM_OK && !dir && !is_list)
        status = om_error(OM_INVALID, "no output folder is given; add -o DIR");
    OmSpace export_space = OM_SPACE_NONE;
    if (status == OM_OK) status = parse_def(&args, input, &def);
    if (status == OM_OK) status = parse_space(&args, "--export-space", &export_space);
    if (status < 0) {
        om_cli_fail("model", status);
        return OM_EXIT_USAGE;
    }

    OmDicomSeries dicom = {0};
    if (!is_list) status = om_cli_check_apart(dir, &input, 1);
    if (!is_list && status == OM_OK) status = om_folder_check(dir, OM_PATIENT_KIND);
    if (status == OM_OK) status = take_dicom(input, &def, &dicom);
    if (status < 0) return om_cli_fail("model", status);
    const bool is_quiet = om_cli_get(&args, "--quiet") != NULL;
    int code =
        is_list ? om_cli_model_list(&def, is_quiet) : build(&def, export_space, is_quiet, dir);
    om_dicom_done(&dicom);
    return code;
}

const OmCliVerb om_cli_verb_model = {
    .name = "model",
    .run = om_cli_model,
    .summary = "build a patient model from a CT, a label map or a mesh",
    .usage = "omentum model INPUT -o DIR [options]\n"
             "omentum model --list INPUT",
    .about =
        "Builds a patient model from a volume (NIfTI, NRRD; a DICOM series, where dcm2niix is\n"
        "installed), a volume mesh (msh, vtk, vtu) or a surface (STL, OBJ, PLY, OFF): a\n"
        "tetrahedral mesh with named sets, its materials, and with --sheet the organ below and the\n"
        "region of interest. DIR receives patient.yaml, tissue.vtu, organ.ply, report.json and\n"
        "report.html, all of them or none.\n"
        "\n"
        "Directions (side, where): right, left, anterior, posterior, superior, inferior, lateral,\n"
        "medial, or x,y,z written x/y/z in RAS.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum model --list segmentation.seg.nrrd\n"
        "  omentum model segmentation.seg.nrrd --label liver --edge 6 -o liver\n"
        "  omentum model labels.nii.gz --label 5 --edge 6 -o liver\n"
        "  omentum model breast.nhdr --label 1,2,29,33,40,88,95,125,150,225 --edge 5 -o breast\n"
        "  omentum model ct.nii.gz --window 150,3000 --all-parts --edge 4 -o bone\n"
        "  omentum model liver.stl --unit m --edge 5 -o liver\n"
        "  omentum model labels.nii.gz --label 3 --edge 4 --sheet thickness=8,side=lateral \\\n"
        "      --attach \"border:superior 30%\" --attach \"underside:random 20% seed 7\" \\\n"
        "      --tumour radius=12,height=3 -o kidney\n"
        "  omentum model labels.nrrd --label 1 --edge 5 --over organ=2/3,roi=3,side=anterior \\\n"
        "      --attach \"underside:left 30%\" -o fat",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
