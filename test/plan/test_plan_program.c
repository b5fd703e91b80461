// test_plan_program.c: the logic program on its own: facts in, the expected answer out, and every one of its
// statements needed by some case.
#include "plan/plan_internal.h"
#include "test_common.h"

#define CASES "asp/tissue_retraction_test.txt"
#define MAX_ATOM 64

static int nwarning;
static void count_warning(void* ctx, OmLogLevel level, const char* line) {
    (void)ctx;
    (void)line;
    nwarning += level == OM_LOG_WARNING;
}

// ---- the cases ---------------------------------------------------------------------------------------

typedef struct Case {
    char name[128];
    int ntrue, nfalse, nassume, nexpect, ncost;
    OmSymbol is_true[MAX_ATOM], is_false[MAX_ATOM], assume[MAX_ATOM], expect[MAX_ATOM];
    bool is_negative[MAX_ATOM];  // of assume
    bool is_unsat;
    int distance[2][4];  // -1 none
    int64_t cost[8];
} Case;

static Case cases[80];
static int ncase;
static char facts[1024];

static OmSymbol term(const char* text) {
    OmSymbol s;
    assert_ok(om__asp_parse(text, &s));
    return s;
}

static void read_word(Case* c, const char* key, char* word, int at) {
    if (strcmp(key, "true") == 0) c->is_true[c->ntrue++] = term(word);
    if (strcmp(key, "false") == 0) c->is_false[c->nfalse++] = term(word);
    if (strcmp(key, "roi") == 0) c->distance[0][at] = atoi(word);
    if (strcmp(key, "attachments") == 0) c->distance[1][at] = atoi(word);
    if (strcmp(key, "cost") == 0) c->cost[c->ncost++] = atoi(word);
    if (strcmp(key, "assume") == 0) {
        c->is_negative[c->nassume] = word[0] == '-';
        c->assume[c->nassume++] = term(word + (word[0] == '-'));
    }
    if (strcmp(key, "expect") == 0) {
        if (strcmp(word, "unsat") == 0) {
            c->is_unsat = true;
        } else if (strcmp(word, "none") != 0) {
            c->expect[c->nexpect++] = term(word);
        }
    }
}

static int read_cases(void** state) {
    (void)state;
    char* data;
    size_t size;
    assert_ok(om_file_read(CASES, 1 << 20, &data, &size));
    for (char *line = data, *next; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next) *next++ = 0;
        char* save = NULL;
        char* key = strtok_r(line, " ", &save);
        if (!key || key[0] == '#') continue;
        if (strcmp(key, "case") == 0) {
            Case* c = &cases[ncase++];
            assert_true(ncase <= (int)(sizeof cases / sizeof cases[0]));
            snprintf(c->name, sizeof c->name, "%s", save);
            for (int i = 0; i < 8; i++) c->distance[i / 4][i % 4] = -1;
            continue;
        }
        int at = 0;
        for (char* word = strtok_r(NULL, " ", &save); word;
             word = strtok_r(NULL, " ", &save), at++) {
            if (strcmp(key, "facts") == 0) {
                snprintf(facts + strlen(facts), sizeof facts - strlen(facts), "%s.", word);
            } else {
                read_word(&cases[ncase - 1], key, word, at);
            }
        }
    }
    om_free(data);
    return 0;
}

// ---- running one ---------------------------------------------------------------------------------------

typedef struct Runner {
    OmAsp* asp;
    int nset;
    int32_t set[2 * MAX_ATOM];  // literals true now
} Runner;

static OmStatus start(Runner* r, const char* program) {
    static const char* const arg[] = {"-c", "n=2",        "-c",      "horizon=12",
                                      "-c", "max_lift=2", "--seed=1"};
    memset(r, 0, sizeof *r);
    OM_TRY(om__asp_create(arg, 7, &r->asp));
    OM_TRY(om__asp_add(r->asp, program));
    OM_TRY(om__asp_add(r->asp, facts));
    return om__asp_ground(r->asp, &(OmAspPart){"base", NULL, 0}, 1);
}

static OmStatus set_true(Runner* r, OmSymbol atom) {
    int32_t literal;
    OM_TRY(om__asp_find_external(r->asp, atom, &literal));
    OM_CHECK(literal, OM_INVALID, "no such external atom");
    OM_TRY(om__asp_assign(r->asp, literal, true));
    r->set[r->nset++] = literal;
    return OM_OK;
}

static OmStatus set_distances(Runner* r, const Case* c) {
    static const char* const block[4] = {"b(1,1)", "b(2,1)", "b(1,2)", "b(2,2)"};
    for (int i = 0; i < 8; i++) {
        if (c->distance[i / 4][i % 4] < 0) continue;
        OmSymbol arg[4] = {term(block[i % 4]), term(i < 4 ? "roi" : "attachments"),
                           om__asp_number(c->distance[i / 4][i % 4]), om__asp_number(0)};
        OmSymbol atom = om__asp_function("distance", arg, 4);
        int32_t literal;
        OM_TRY(om__asp_find_external(r->asp, atom, &literal));
        if (!literal) OM_TRY(om__asp_ground(r->asp, &(OmAspPart){"sensed_distance", arg, 3}, 1));
        OM_TRY(set_true(r, atom));
    }
    return OM_OK;
}

static bool contains(const OmSymbol* set, int n, OmSymbol s) {
    for (int i = 0; i < n; i++) {
        if (set[i] == s) return true;
    }
    return false;
}

// OM_OK if the answer is the expected one; anything else: the message tells.
static OmStatus run(Runner* r, const Case* c) {
    static const char* const reachable[4] = {"reachable(psm1,b(1,1),0)", "reachable(psm1,b(2,1),0)",
                                             "reachable(psm2,b(1,2),0)",
                                             "reachable(psm2,b(2,2),0)"};
    static OmAspAnswer answer;
    while (r->nset > 0) OM_TRY(om__asp_assign(r->asp, r->set[--r->nset], false));
    for (int i = 0; i < 4; i++) {
        OmSymbol atom = term(reachable[i]);
        if (!contains(c->is_false, c->nfalse, atom)) OM_TRY(set_true(r, atom));
    }
    for (int i = 0; i < c->ntrue; i++) OM_TRY(set_true(r, c->is_true[i]));
    OM_TRY(set_distances(r, c));
    int32_t assume[MAX_ATOM];
    bool is_false = false;
    for (int i = 0; i < c->nassume; i++) {
        OM_TRY(om__asp_find(r->asp, c->assume[i], &assume[i]));
        is_false = is_false || assume[i] == 0;  // an atom without rules is false
        if (c->is_negative[i]) assume[i] = -assume[i];
    }
    if (is_false) {
        OM_CHECK(c->is_unsat, OM_INVALID, "an assumed atom does not exist");
        return OM_OK;
    }
    OmStatus status = om__asp_solve(r->asp, assume, c->nassume, 5.0, &answer);
    if (status != OM_OK) return status;
    OM_CHECK(answer.has_model == !c->is_unsat, OM_INVALID, "%s expected",
             c->is_unsat ? "unsat" : "an answer");
    if (c->is_unsat) return OM_OK;
    OM_CHECK(answer.nsymbol == c->nexpect, OM_INVALID, "%d atoms, %d expected", answer.nsymbol,
             c->nexpect);
    for (int i = 0; i < c->nexpect; i++) {
        OM_CHECK(contains(answer.symbol, answer.nsymbol, c->expect[i]), OM_INVALID,
                 "expected atom %d is missing", i);
    }
    for (int i = 0; i < c->ncost; i++) {
        OM_CHECK(i < answer.ncost && answer.cost[i] == c->cost[i], OM_INVALID,
                 "cost[%d] is %lld, not %lld", i, i < answer.ncost ? (long long)answer.cost[i] : -1,
                 (long long)c->cost[i]);
    }
    return OM_OK;
}

static void test_cases(void** state) {
    (void)state;
    Runner r;
    nwarning = 0;
    assert_ok(start(&r, om_planner_program()));
    assert_int_equal(nwarning, 0);
    int nfailed = 0;
    for (int i = 0; i < ncase; i++) {
        // each distance set is a ground program of its own, so that no level of cost is left from another
        om__asp_destroy(r.asp);
        assert_ok(start(&r, om_planner_program()));
        if (run(&r, &cases[i]) == OM_OK) continue;
        print_message("case \"%s\": %s\n", cases[i].name, om_error_message());
        nfailed++;
    }
    om__asp_destroy(r.asp);
    assert_int_equal(nfailed, 0);
    print_message("%d cases\n", ncase);
}

// ---- every statement is needed -----------------------------------------------------------------------------

// End of the statement at `s`: past its period, or past the ] of a weak constraint.
static const char* statement_end(const char* s) {
    bool is_weak = s[0] == ':' && s[1] == '~', in_text = false;
    for (; *s; s++) {
        if (*s == '"') in_text = !in_text;
        if (in_text) continue;
        if (is_weak && *s == ']') return s + 1;
        if (*s == '.' && s[1] == '.') {
            s++;
            continue;
        }
        if (!is_weak && *s == '.') return s + 1;
    }
    return s;
}

// Whether some case tells the program from the true one.
static bool is_told(const char* program) {
    Runner r;
    nwarning = 0;
    bool told = start(&r, program) < 0 || nwarning > 0;
    for (int i = 0; i < ncase && !told; i++) {
        if (cases[i].ncost > 0 && r.asp) {
            om__asp_destroy(r.asp);
            if (start(&r, program) < 0) told = true;
        }
        told = told || run(&r, &cases[i]) != OM_OK;
    }
    om__asp_destroy(r.asp);
    return told;
}

static void test_every_statement_is_needed(void** state) {
    (void)state;
    const char* program = om_planner_program();
    char* mutant = strdup(program);
    assert_non_null(mutant);
    // a quick run takes out every sixth statement, the slow run each of them
    int nstatement = 0, nmissed = 0, stride = test_count(6, 1);
    for (const char* s = program; *s;) {
        if (*s == '%') s += strcspn(s, "\n");
        if (*s == ' ' || *s == '\n') {
            s++;
            continue;
        }
        if (!*s || *s == '%') continue;
        const char* end = statement_end(s);
        size_t at = (size_t)(s - program), len = (size_t)(end - s);
        // the caller sets the constants; #defined only keeps clingo from warning
        bool is_spared = strncmp(s, "#const", 6) == 0 || strncmp(s, "#defined", 8) == 0;
        if (!is_spared) {
            memcpy(mutant, program, strlen(program));
            memset(mutant + at, ' ', len);
            nstatement++;
            if (nstatement % stride == 0 && !is_told(mutant)) {
                nmissed++;
                print_message("no case needs: %.*s\n", (int)len, s);
            }
        }
        s = end;
    }
    free(mutant);
    print_message("%d statements\n", nstatement);
    assert_int_equal(nmissed, 0);
}

int main(void) {
    om_log_set_sink(count_warning, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cases),
        cmocka_unit_test(test_every_statement_is_needed),
    };
    return cmocka_run_group_tests(tests, read_cases, NULL);
}
