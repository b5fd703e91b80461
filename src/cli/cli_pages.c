// cli_pages.c: help, man page and shell completion, all from the tables of the verbs.
#include <string.h>

#include "cli_common.h"

static const struct {
    int code;
    const char* what;
} exit_table[] = {
    {OM_EXIT_OK, "done"},
    {OM_EXIT_FAILED, "done, with a negative outcome: not exposed, no plan, a criterion missed"},
    {OM_EXIT_USAGE, "the command line is wrong"},
    {OM_EXIT_ERROR, "bad input, failed output, or no memory"},
    {OM_EXIT_STDOUT, "done and files are written, but standard output failed"},
    {OM_EXIT_CANCELLED, "cancelled by Ctrl-C or SIGTERM"},
};
#define NEXIT ((int)(sizeof exit_table / sizeof *exit_table))

// Is `verb` in this group?
static bool is_in(const OmCliVerb* group, const OmCliVerb* verb) {
    size_t n = strlen(group->name);
    return strncmp(verb->name, group->name, n) == 0 && verb->name[n] == ' ';
}

// "default 4; 0.01 to 1000 mm", or nothing.
static void describe_value(const OmCliOption* o, char* out, size_t size) {
    char range[96] = "";
    bool has_range = o->min != 0 || o->max != 0;
    if (has_range && o->max >= 2147483647)
        snprintf(range, sizeof range, "%g or more", o->min);
    else if (has_range)
        snprintf(range, sizeof range, "%g to %.10g", o->min, o->max);
    snprintf(out, size, "%s%s%s%s%s%s", o->preset ? "default: " : "", o->preset ? o->preset : "",
             o->preset && has_range ? "; " : "", range, has_range && o->unit ? " " : "",
             has_range && o->unit ? o->unit : "");
}

// ---- help -------------------------------------------------------------------------------------------------

static void print_lines(const char* text) {
    if (text && *text) printf("%s\n", text);
}

static void print_members(const OmCliVerb* group) {
    const OmCliVerb* v;
    size_t skip = strlen(group->name) + 1;
    printf("\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k)
        if (is_in(group, v)) printf("  %-18s %s\n", v->name + skip, v->summary);
    printf("\n  omentum help %s NAME   options and examples\n", group->name);
}

static void print_options(const OmCliVerb* verb) {
    const OmCliOption* o;
    printf("\nOptions (also --name=value):\n");
    for (int k = 0; (o = om_cli_option_at(verb, k)); ++k) {
        char left[80], value[200];
        snprintf(left, sizeof left, "%s%s%s%s%s", o->name, o->alias ? ", " : "",
                 o->alias ? o->alias : "", o->arg ? " " : "", o->arg ? o->arg : "");
        describe_value(o, value, sizeof value);
        printf("  %-26s %s%s%s%s\n", left, o->help, *value ? " (" : "", value, *value ? ")" : "");
    }
}

void om_cli_print_help(const OmCliVerb* verb) {
    printf("omentum %s: %s\n\n", verb->name, verb->summary);
    for (const char* at = verb->usage; *at;) {
        int n = (int)strcspn(at, "\n");
        printf("%s %.*s\n", at == verb->usage ? "Usage:" : "      ", n, at);
        at += n + (at[n] == '\n');
    }
    printf("\n");
    print_lines(verb->about);
    if (!verb->run) {
        print_members(verb);
        return;
    }
    print_options(verb);
    if (verb->nkey > 0) printf("\n%s of --json:\n", verb->has_own_json ? "Keys" : "Figures");
    for (int k = 0; k < verb->nkey; ++k)
        printf("  %-26s %s\n", verb->key[k].name, verb->key[k].help);
    printf("\nExamples:\n");
    print_lines(verb->example);
}

// ---- man page -----------------------------------------------------------------------------------------------

// Write running text for roff.
static void put_roff(const char* text) {
    bool is_begin = true;
    for (; *text; ++text) {
        if (is_begin && (*text == '.' || *text == '\'')) printf("\\&");
        if (*text == '-')
            printf("\\-");
        else if (*text == '\\')
            printf("\\e");
        else
            putchar(*text);
        is_begin = *text == '\n';
    }
}

static void put_block(const char* text) {
    printf(".nf\n");
    put_roff(text);
    printf("\n.fi\n");
}

static void put_man_verb(const OmCliVerb* verb) {
    const OmCliOption* o;
    printf(".SS omentum ");
    put_roff(verb->name);
    printf("\n");
    put_block(verb->usage);
    printf(".PP\n");
    put_roff(verb->summary);
    printf(".\n");
    if (verb->about && *verb->about) printf(".PP\n"), put_roff(verb->about), printf("\n");
    if (!verb->run) return;
    for (int k = 0; (o = om_cli_option_at(verb, k)); ++k) {
        char value[200];
        printf(".TP\n.B ");
        put_roff(o->name);
        if (o->alias) printf(", "), put_roff(o->alias);
        if (o->arg) printf(" \\fI"), put_roff(o->arg), printf("\\fR");
        printf("\n");
        put_roff(o->help);
        describe_value(o, value, sizeof value);
        if (*value) printf(" ("), put_roff(value), printf(")");
        printf(".\n");
    }
    printf(".PP\n%s of \\-\\-json:\n", verb->has_own_json ? "Keys" : "Figures");
    for (int k = 0; k < verb->nkey; ++k) {
        printf(".TP\n.I ");
        put_roff(verb->key[k].name);
        printf("\n");
        put_roff(verb->key[k].help);
        printf(".\n");
    }
    printf(".PP\nExamples:\n");
    put_block(verb->example);
}

void om_cli_print_man(void) {
    const OmCliVerb* v;
    printf(".TH OMENTUM 1 \"\" \"omentum %s\" \"User Commands\"\n", om_version());
    printf(
        ".SH NAME\nomentum \\- patient\\-specific simulation of soft tissue for autonomous surgery\n");
    printf(
        ".SH SYNOPSIS\n.B omentum\n.I VERB\n[options]\n.br\n.B omentum help\n[\\fIVERB\\fR]\n.br\n"
        ".B omentum completion\nbash|zsh|fish\n.br\n.B omentum man\n.br\n.B omentum \\-\\-version\n");
    printf(".SH VERBS\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k) put_man_verb(v);
    printf(".SH EXIT STATUS\n");
    for (int k = 0; k < NEXIT; ++k)
        printf(".TP\n.B %d\n%s.\n", exit_table[k].code, exit_table[k].what);
    printf(
        ".SH RESULT FOR PROGRAMS\nWith \\-\\-json standard output receives one object with the keys program, version, "
        "verb, outcome, exit_code, message, figures and paths; text for people goes to standard error.\n");
}

// ---- completion ---------------------------------------------------------------------------------------------

// Each word of the first level once, or the words of a group.
static void put_words(const OmCliVerb* group) {
    const OmCliVerb* v;
    const char* space = "";
    for (int k = 0; (v = om_cli_verb_at(k)); ++k) {
        bool is_wanted = group ? is_in(group, v) : strchr(v->name, ' ') == NULL;
        if (!is_wanted) continue;
        printf("%s%s", space, group ? v->name + strlen(group->name) + 1 : v->name);
        space = " ";
    }
    if (!group) printf(" help completion man --help --version");
}

static void put_options(const OmCliVerb* verb) {
    const OmCliOption* o;
    for (int k = 0; (o = om_cli_option_at(verb, k)); ++k) {
        printf("%s%s", k ? " " : "", o->name);
        if (o->alias) printf(" %s", o->alias);
    }
}

static void put_bash(void) {
    const OmCliVerb* v;
    printf("# bash completion of omentum, made by: omentum completion bash\n"
           "_omentum() {\n"
           "    local cur=${COMP_WORDS[COMP_CWORD]} first=1 words=\n"
           "    [[ ${COMP_WORDS[1]} == help ]] && first=2\n"
           "    local one=${COMP_WORDS[first]} two=${COMP_WORDS[first]}\\ ${COMP_WORDS[first+1]}\n"
           "    (( COMP_CWORD <= first )) && one= two=\n"
           "    (( COMP_CWORD <= first + 1 )) && two=\n"
           "    case $two in\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k) {
        if (!strchr(v->name, ' ')) continue;
        printf("    '%s') words='", v->name);
        put_options(v);
        printf("' ;;\n");
    }
    printf("    *) case $one in\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k) {
        if (strchr(v->name, ' ')) continue;
        printf("        '%s') words='", v->name);
        if (v->run)
            put_options(v);
        else
            put_words(v);
        printf("' ;;\n");
    }
    printf("        completion) words='bash zsh fish' ;;\n        '') words='");
    put_words(NULL);
    printf("' ;;\n        esac ;;\n    esac\n"
           "    COMPREPLY=($(compgen -W \"$words\" -- \"$cur\"))\n"
           "    [[ $cur == -* ]] || COMPREPLY+=($(compgen -f -- \"$cur\"))\n"
           "}\n"
           "complete -o filenames -F _omentum omentum\n");
}

// Write text between single quotes of a shell.
static void put_quoted(const char* text, const char* escaped) {
    for (; *text; ++text) {
        if (*text == '\'')
            printf("'\\''");
        else if (strchr(escaped, *text))
            printf("\\%c", *text);
        else
            putchar(*text);
    }
}

static void put_zsh(void) {
    const OmCliVerb* v;
    const OmCliOption* o;
    printf("#compdef omentum\n# zsh completion of omentum, made by: omentum completion zsh\n"
           "_omentum() {\n"
           "    local first=2\n"
           "    [[ ${words[2]} == help ]] && first=3\n"
           "    local one=${words[first]} two=\"${words[first]} ${words[first+1]}\"\n"
           "    (( CURRENT <= first )) && one= two=\n"
           "    (( CURRENT <= first + 1 )) && two=\n"
           "    case $two in\n");
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1) printf("    esac\n    case $one in\n");
        for (int k = 0; (v = om_cli_verb_at(k)); ++k) {
            if ((strchr(v->name, ' ') != NULL) != (pass == 0)) continue;
            printf("    '%s')", v->name);
            if (!v->run) {
                printf(" compadd -- "), put_words(v), printf("; return ;;\n");
                continue;
            }
            printf(" _arguments '*:file:_files'");
            for (int i = 0; (o = om_cli_option_at(v, i)); ++i) {
                for (int name = 0; name < 2; ++name) {
                    if (name == 1 && !o->alias) continue;
                    printf(" \\\n        '*%s%s[", name ? o->alias : o->name,
                           o->arg && !name ? "=" : "");
                    put_quoted(o->help, "[]:\\");
                    printf("]");
                    if (o->arg) printf(":"), put_quoted(o->arg, "[]:\\"), printf(":_files");
                    printf("'");
                }
            }
            printf("; return ;;\n");
        }
    }
    printf("    completion) compadd bash zsh fish; return ;;\n    '') compadd -- ");
    put_words(NULL);
    printf(" ;;\n    esac\n}\n_omentum \"$@\"\n");
}

// The condition under which fish offers an option or a word.
static void put_fish_condition(const OmCliVerb* verb) {
    printf("complete -c omentum -n '");
    const char* at = verb->name;
    const char* also = "";
    while (*at) {
        size_t n = strcspn(at, " ");
        printf("%s__fish_seen_subcommand_from %.*s", also, (int)n, at);
        at += n + (at[n] == ' ');
        also = "; and ";
    }
    printf("'");
}

static void put_fish(void) {
    const OmCliVerb* v;
    const OmCliOption* o;
    printf("# fish completion of omentum, made by: omentum completion fish\n");
    printf("complete -c omentum -n __fish_use_subcommand -f -a '");
    put_words(NULL);
    printf(
        "'\ncomplete -c omentum -n '__fish_seen_subcommand_from completion' -f -a 'bash zsh fish'\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k) {
        if (!v->run) {
            put_fish_condition(v);
            printf(" -f -a '"), put_words(v), printf("'\n");
            continue;
        }
        for (int i = 0; (o = om_cli_option_at(v, i)); ++i) {
            put_fish_condition(v);
            printf(" -l %s", o->name + 2);
            if (o->alias)
                printf(o->alias[1] == '-' ? " -l %s" : " -s %s", o->alias + strspn(o->alias, "-"));
            printf("%s -d '", o->arg ? " -r" : "");
            for (const char* c = o->help; *c; ++c) printf(*c == '\'' ? "\\'" : "%c", *c);
            printf("'\n");
        }
    }
}

bool om_cli_print_completion(const char* shell) {
    if (strcmp(shell, "bash") == 0)
        put_bash();
    else if (strcmp(shell, "zsh") == 0)
        put_zsh();
    else if (strcmp(shell, "fish") == 0)
        put_fish();
    else
        return false;
    return true;
}
