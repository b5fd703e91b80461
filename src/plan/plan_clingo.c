// plan_clingo.c: clingo behind our own types. The only file that uses libclingo.
//
// One control object is grounded in parts and solved many times. The search runs in clingo's own thread so that
// a time limit can end it; it has one search thread, so that the same input gives the same answer. Warnings of
// clingo (such as for a misspelt predicate) are collected: they become the message of a failure, or lines of the
// log.
#include <string.h>

#include "plan/plan_clingo_api.h"
#include "plan/plan_internal.h"

#define MESSAGE_LIMIT 20  // warnings of clingo kept for one call

struct OmAsp {
    clingo_control_t* control;
    OmText message;       // messages of clingo during the current call
    OmAspAnswer* answer;  // being filled by on_event
    bool has_overflow;
};

// Join the lines of one message: clingo breaks and indents them.
static void on_message(int code, const char* message, void* data) {
    OmAsp* asp = data;
    (void)code;
    for (const char* c = message; *c;) {
        size_t len = strcspn(c, "\n");
        (void)om_text_append_raw(&asp->message, c, len);
        c += len;
        c += strspn(c, "\n ");
        if (*c) (void)om_text_append(&asp->message, " ");
    }
    (void)om_text_append(&asp->message, "\n");
}

static void forget_messages(OmAsp* asp) {
    if (asp->message.len > 0) asp->message.str[0] = 0;
    asp->message.len = 0;
}

// The message of a failed call: clingo's first error, "file:3:5-9: error: syntax error, unexpected ...", and the
// number of further errors.
static OmStatus fail(OmAsp* asp, const char* doing) {
    OmStatus status = clingo_error_code() == clingo_error_bad_alloc ? OM_NO_MEMORY : OM_INVALID;
    const char *last = clingo_error_message(), *first = NULL;
    int nerror = 0;
    for (char* line = asp->message.len > 0 ? asp->message.str : NULL; line && *line;) {
        size_t len = strcspn(line, "\n");
        char* next = line + len + (line[len] == '\n');
        line[len] = 0;
        if (strstr(line, "error:") && nerror++ == 0) first = line;
        line = next;
    }
    if (!first) first = last ? last : "clingo failed without a word";
    if (nerror > 1) {
        status = om_error(status, "%s: %s (and %d more error%s)", doing, first, nerror - 1,
                          nerror == 2 ? "" : "s");
    } else {
        status = om_error(status, "%s: %s", doing, first);
    }
    forget_messages(asp);
    return status;
}

// Log the warnings of a call that succeeded, a line each.
static void log_messages(OmAsp* asp) {
    for (const char* line = asp->message.len > 0 ? asp->message.str : ""; *line;) {
        size_t len = strcspn(line, "\n");
        om_log(OM_LOG_WARNING, "clingo: %.*s", (int)len, line);
        line += len + (line[len] == '\n');
    }
    forget_messages(asp);
}

OmStatus om__asp_create(const char* const* arg, int narg, OmAsp** out) {
    *out = NULL;
    OmAsp* asp = om_calloc(1, sizeof *asp);
    if (!asp) return OM_NO_MEMORY;
    if (!clingo_control_new(arg, (size_t)narg, on_message, asp, MESSAGE_LIMIT, &asp->control)) {
        asp->control = NULL;
        OmStatus status = fail(asp, "starting clingo");
        om__asp_destroy(asp);
        return status;
    }
    *out = asp;
    return OM_OK;
}

void om__asp_destroy(OmAsp* asp) {
    if (!asp) return;
    if (asp->control) clingo_control_free(asp->control);
    om_text_done(&asp->message);
    om_free(asp);
}

OmStatus om__asp_load(OmAsp* asp, const char* path) {
    if (!clingo_control_load(asp->control, path)) return fail(asp, "reading the logic program");
    log_messages(asp);
    return OM_OK;
}

OmStatus om__asp_add(OmAsp* asp, const char* text) {
    if (!clingo_control_add(asp->control, "base", NULL, 0, text)) {
        return fail(asp, "reading the logic program");
    }
    log_messages(asp);
    return OM_OK;
}

OmStatus om__asp_ground(OmAsp* asp, const OmAspPart* part, int npart) {
    clingo_part_t* p;
    OM_ALLOC(p, npart);
    for (int i = 0; i < npart; i++) {
        p[i] = (clingo_part_t){part[i].name, part[i].arg, (size_t)part[i].narg};
    }
    bool is_done = clingo_control_ground(asp->control, p, (size_t)npart, NULL, NULL);
    om_free(p);
    if (!is_done) return fail(asp, "grounding the logic program");
    log_messages(asp);
    return OM_OK;
}

// Clingo's thread calls this for each better model.
static bool on_event(unsigned type, void* event, void* data, bool* goon) {
    OmAsp* asp = data;
    *goon = true;
    if (type != clingo_solve_event_type_model) return true;
    const clingo_model_t* model = event;
    OmAspAnswer* a = asp->answer;
    size_t nsymbol = 0, ncost = 0;
    if (!clingo_model_symbols_size(model, clingo_show_type_shown, &nsymbol)) return false;
    if (!clingo_model_cost_size(model, &ncost)) return false;
    if (nsymbol > OM_ASP_MAX_SYMBOL || ncost > OM_ASP_MAX_COST) {
        asp->has_overflow = true;
        *goon = false;
        return true;
    }
    if (!clingo_model_symbols(model, clingo_show_type_shown, a->symbol, nsymbol)) return false;
    if (ncost > 0 && !clingo_model_cost(model, a->cost, ncost)) return false;
    a->has_model = true;
    a->nsymbol = (int)nsymbol;
    a->ncost = (int)ncost;
    return true;
}

OmStatus om__asp_solve(OmAsp* asp, const int32_t* assume, int nassume, double time_limit,
                       OmAspAnswer* answer) {
    asp->answer = answer;
    asp->has_overflow = false;
    answer->has_model = answer->is_final = false;
    answer->nsymbol = answer->ncost = 0;
    clingo_solve_handle_t* handle = NULL;
    const bool waits = time_limit > 0 || om_stop_is_set();
    unsigned mode = waits ? clingo_solve_mode_async : 0, result = 0;
    bool is_ok =
        clingo_control_solve(asp->control, mode, assume, (size_t)nassume, on_event, asp, &handle);
    OmStatus stopped = OM_OK;
    if (is_ok && waits) {
        // a wait of clingo may end early, by the notification of its own thread's start: only the clock decides
        const double most = time_limit > 0 ? time_limit : HUGE_VAL, end = om_clock_now() + most;
        const double longest = om_stop_is_set() ? OM_STOP_PERIOD : HUGE_VAL;
        bool is_ready = false;
        for (double left = most; !is_ready && left > 0 && stopped == OM_OK;
             left = end - om_clock_now()) {
            clingo_solve_handle_wait(handle, fmin(left, longest), &is_ready);
            stopped = om_stop_poll();
        }
        if (!is_ready) is_ok = clingo_solve_handle_cancel(handle);
    }
    is_ok = is_ok && clingo_solve_handle_get(handle, &result);
    OmStatus status = is_ok ? OM_OK : fail(asp, "solving the logic program");
    if (handle && !clingo_solve_handle_close(handle) && status == OM_OK) {
        status = fail(asp, "solving the logic program");
    }
    if (status >= 0 && stopped < 0) return om_error(stopped, "stopped by a request");
    if (status < 0) return status;
    log_messages(asp);
    OM_CHECK(
        !asp->has_overflow, OM_INVALID,
        "the logic program shows more than %d atoms or has more than %d levels of optimisation; "
        "show only actions",
        OM_ASP_MAX_SYMBOL, OM_ASP_MAX_COST);
    // a search that is cancelled before it begins also reports "unsatisfiable"
    answer->is_final =
        (result & clingo_solve_result_interrupted) == 0 &&
        (result & (clingo_solve_result_exhausted | clingo_solve_result_unsatisfiable)) != 0;
    return answer->is_final ? OM_OK : OM_TIMEOUT;
}

OmStatus om__asp_assign(OmAsp* asp, int32_t literal, bool value) {
    int truth = value ? clingo_truth_value_true : clingo_truth_value_false;
    if (!clingo_control_assign_external(asp->control, literal, truth)) {
        return fail(asp, "setting an external atom");
    }
    return OM_OK;
}

static OmStatus find(OmAsp* asp, OmSymbol atom, bool is_external_only, int32_t* literal) {
    *literal = 0;
    const clingo_symbolic_atoms_t* atoms;
    clingo_symbolic_atom_iterator_t it;
    bool is_valid = false, is_external = true;
    bool is_ok = clingo_control_symbolic_atoms(asp->control, &atoms) &&
                 clingo_symbolic_atoms_find(atoms, atom, &it) &&
                 clingo_symbolic_atoms_is_valid(atoms, it, &is_valid);
    if (is_ok && is_valid && is_external_only) {
        is_ok = clingo_symbolic_atoms_is_external(atoms, it, &is_external);
    }
    if (is_ok && is_valid && is_external) is_ok = clingo_symbolic_atoms_literal(atoms, it, literal);
    return is_ok ? OM_OK : fail(asp, "looking up an atom");
}

OmStatus om__asp_find(OmAsp* asp, OmSymbol atom, int32_t* literal) {
    return find(asp, atom, false, literal);
}

OmStatus om__asp_find_external(OmAsp* asp, OmSymbol atom, int32_t* literal) {
    return find(asp, atom, true, literal);
}

OmStatus om__asp_list(OmAsp* asp, const char* name, int arity, OmSymbol* atom, int max,
                      int* count) {
    *count = 0;
    const clingo_symbolic_atoms_t* atoms;
    clingo_signature_t signature;
    clingo_symbolic_atom_iterator_t it;
    bool is_valid = false;
    bool is_ok = clingo_signature_create(name, (uint32_t)arity, true, &signature) &&
                 clingo_control_symbolic_atoms(asp->control, &atoms) &&
                 clingo_symbolic_atoms_begin(atoms, &signature, &it);
    while (is_ok) {
        is_ok = clingo_symbolic_atoms_is_valid(atoms, it, &is_valid);
        if (!is_ok || !is_valid) break;
        if (*count < max) is_ok = clingo_symbolic_atoms_symbol(atoms, it, &atom[*count]);
        ++*count;
        is_ok = is_ok && clingo_symbolic_atoms_next(atoms, it, &it);
    }
    return is_ok ? OM_OK : fail(asp, "listing atoms");
}

OmSymbol om__asp_number(int value) {
    clingo_symbol_t s;
    clingo_symbol_create_number(value, &s);
    return s;
}

OmSymbol om__asp_function(const char* name, const OmSymbol* arg, int narg) {
    clingo_symbol_t s = 0;
    if (!clingo_symbol_create_function(name, arg, (size_t)narg, true, &s)) {
        (void)om_error(OM_NO_MEMORY, "no memory for an atom %s", name);
        return 0;
    }
    return s;
}

static void ignore_message(int code, const char* message, void* data) {
    (void)code;
    (void)message;
    (void)data;
}

OmStatus om__asp_parse(const char* text, OmSymbol* symbol) {
    *symbol = 0;
    OM_CHECK(clingo_parse_term(text, ignore_message, NULL, 0, symbol), OM_INVALID,
             "\"%s\" is not a term", text);
    return OM_OK;
}

const char* om__asp_name(OmSymbol symbol, const OmSymbol** arg, int* narg) {
    const char* name = "";
    size_t size = 0;
    *narg = -1;
    if (clingo_symbol_type(symbol) != clingo_symbol_type_function) return name;
    if (!clingo_symbol_name(symbol, &name) || !clingo_symbol_arguments(symbol, arg, &size))
        return "";
    *narg = (int)size;
    return name;
}

int om__asp_number_of(OmSymbol symbol) {
    int value;
    if (clingo_symbol_type(symbol) != clingo_symbol_type_number) return -1;
    return clingo_symbol_number(symbol, &value) ? value : -1;
}

const char* om__asp_text_of(OmSymbol symbol) {
    const char* text;
    if (clingo_symbol_type(symbol) != clingo_symbol_type_string) return NULL;
    return clingo_symbol_string(symbol, &text) ? text : NULL;
}
