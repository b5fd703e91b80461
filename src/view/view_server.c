// view_server.c: HTTP and WebSocket by libwebsockets, in one thread.
//
// The program and this thread share the lasting messages, the newest one and the lines of the page, under one mutex,
// which is held for a copy at most. Only this thread calls libwebsockets, but for lws_cancel_service, by which the
// program wakes it.
#include "omentum/view_server.h"

#include <ctype.h>
#include <libwebsockets.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>

#include "base/base_grow.h"
#include "omentum/base_job.h"
#include "view/view_internal.h"

#define COOKIE 0x71e35e7u
#define MAX_LINES 64  // that wait for the program
#define KEPT_LINES 4  // the last places: for lines that stop something
#define TOO_MANY "too many commands; the last was left out"
#define COOKIE_NAME "omentum_token"
#define BODY_TIME 30  // s that a client may take for one chunk
#define CHUNK 16384   // bytes of a file in one write
#define MAX_CLIENT 32

enum { NNEWEST = 2 };  // channels of which the last message counts: frames, status

typedef struct Message {
    char* data;
    size_t size;
} Message;

struct OmViewServer {
    struct lws_context* lws;
    OmJob* job;
    char address[64], token[80], url[256];
    char *html, *file;  // the live page; a page to serve in its place, or null
    size_t html_size, file_size;
    atomic_bool is_ending;
    pthread_mutex_t mutex;  // of what follows
    Message* lasting;
    int nlasting, capacity, generation;
    Message newest[NNEWEST];
    uint64_t number[NNEWEST];
    char line[MAX_LINES][OM_VIEW_MAX_LINE + 1];
    int nline, first;
    int nclient;
    // in the order of their opening; the first has the controls (nclient)
    struct lws* page[MAX_CLIENT];
    double heard;  // when the first was heard last
};

typedef struct Client {  // of a connection; zeroed by libwebsockets
    bool is_page;        // a WebSocket that is counted
    const char* body;    // HTTP: what is left of a file
    size_t left;
    int nlasting, generation;  // messages that it has
    uint64_t number[NNEWEST];
    bool was_told, has_control;
    int nleft_out;  // its lines that found no place, and are not answered yet; at most MAX_LINES
    char line[OM_VIEW_MAX_LINE + 1];
    size_t nline;
} Client;

// ---- requests ------------------------------------------------------------------------------------------------

static bool is_loopback(const char* address) {
    return strcmp(address, "127.0.0.1") == 0 || strcmp(address, "localhost") == 0;
}

// A host of this machine, with or without a port: a page of a stranger has another name.
static bool is_local_host(const char* host) {
    static const char* const name[] = {"127.0.0.1", "localhost", "[::1]"};
    for (size_t k = 0; k < sizeof name / sizeof *name; ++k) {
        const size_t n = strlen(name[k]);
        if (strncmp(host, name[k], n) == 0 && (host[n] == 0 || host[n] == ':')) return true;
    }
    return false;
}

// Compare without a hint in the time it takes.
static bool is_token(const OmViewServer* s, const char* given) {
    unsigned char differs = strlen(given) != strlen(s->token);
    for (size_t i = 0; s->token[i] && given[0]; ++i)
        differs |= (unsigned char)(s->token[i] ^ given[i % strlen(given)]);
    return !differs && given[0];
}

// Other programs of this host may have set cookies, too.
static bool has_cookie(const OmViewServer* s, struct lws* wsi) {
    char text[4096];
    const size_t n = strlen(COOKIE_NAME "=");
    if (lws_hdr_copy(wsi, text, sizeof text, WSI_TOKEN_HTTP_COOKIE) <= 0) return false;
    for (char* at = text; at;) {
        at += strspn(at, " ");
        char* end = strchr(at, ';');
        if (end) *end = 0;
        if (strncmp(at, COOKIE_NAME "=", n) == 0 && is_token(s, at + n)) return true;
        at = end ? end + 1 : NULL;
    }
    return false;
}

// "token=..." of the address, or the cookie that was set with it.
static bool knows_token(const OmViewServer* s, struct lws* wsi) {
    char text[256];
    if (!s->token[0]) return true;
    for (int k = 0; lws_hdr_copy_fragment(wsi, text, sizeof text, WSI_TOKEN_HTTP_URI_ARGS, k) > 0;
         ++k)
        if (strncmp(text, "token=", 6) == 0 && is_token(s, text + 6)) return true;
    return has_cookie(s, wsi);
}

// Of HTTP requests and WebSockets: from this machine's names, or with the token.
static bool is_welcome(const OmViewServer* s, struct lws* wsi) {
    char host[128] = "", origin[160] = "";
    if (lws_hdr_copy(wsi, host, sizeof host, WSI_TOKEN_HOST) <= 0) return false;
    if (is_loopback(s->address) && !is_local_host(host)) return false;
    if (lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0) {
        // one that does not fit is none of ours
        if (lws_hdr_copy(wsi, origin, sizeof origin, WSI_TOKEN_ORIGIN) <= 0) return false;
        const char* name = strncmp(origin, "http://", 7) == 0 ? origin + 7 : "";
        if (strcmp(name, host) != 0) return false;
    }
    return knows_token(s, wsi);
}

typedef struct Answer {
    const char *data, *type;
    size_t size;
} Answer;

static bool find_answer(const OmViewServer* s, const char* path, Answer* a) {
    static const struct {
        const char *path, *type;
        ViewAssetName name;
    } asset[] = {{"/page.css", "text/css", VIEW_CSS},
                 {"/page.js", "text/javascript", VIEW_JS},
                 {"/three_bundle.js", "text/javascript", VIEW_THREE}};
    *a = (Answer){s->file ? s->file : s->html, "text/html; charset=utf-8",
                  s->file ? s->file_size : s->html_size};
    if (strcmp(path, "/") == 0) return true;
    for (size_t k = 0; k < sizeof asset / sizeof *asset; ++k) {
        if (strcmp(path, asset[k].path) != 0) continue;
        const ViewAsset v = om__view_asset(asset[k].name);
        *a = (Answer){v.data, asset[k].type, v.size};
        return true;
    }
    return false;
}

static int add_header(struct lws* wsi, const char* name, const char* value, unsigned char** p,
                      unsigned char* end) {
    return lws_add_http_header_by_name(wsi, (const unsigned char*)name, (const unsigned char*)value,
                                       (int)strlen(value), p, end);
}

static int answer(const OmViewServer* s, struct lws* wsi, Client* c, const char* path) {
    unsigned char buffer[LWS_PRE + 2048], *begin = buffer + LWS_PRE, *p = begin;
    unsigned char* end = buffer + sizeof buffer;
    char cookie[160];
    Answer a;
    if (!is_welcome(s, wsi)) {
        lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, NULL);
        return -1;
    }
    if (!find_answer(s, path, &a))
        return lws_return_http_status(wsi, HTTP_STATUS_NOT_FOUND, NULL) ||
               lws_http_transaction_completed(wsi);
    // a recording has its scripts inside
    const char* policy =
        s->file
            ? "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
              "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
            : "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
              "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, a.type, a.size, &p, end) ||
        add_header(wsi, "content-security-policy:", policy, &p, end) ||
        add_header(wsi, "x-content-type-options:", "nosniff", &p, end) ||
        add_header(wsi, "referrer-policy:", "no-referrer", &p, end) ||
        add_header(wsi, "cache-control:", "no-store", &p, end))
        return 1;
    if (s->token[0]) {
        snprintf(cookie, sizeof cookie, COOKIE_NAME "=%s; HttpOnly; SameSite=Strict", s->token);
        if (add_header(wsi, "set-cookie:", cookie, &p, end)) return 1;
    }
    if (lws_finalize_write_http_header(wsi, begin, &p, end)) return 1;
    c->body = a.data;
    c->left = a.size;
    lws_callback_on_writable(wsi);
    return 0;
}

// Negative: the connection is closed.
static int write_body(struct lws* wsi, Client* c) {
    unsigned char buffer[LWS_PRE + CHUNK];
    const size_t n = c->left < CHUNK ? c->left : CHUNK;
    memcpy(buffer + LWS_PRE, c->body, n);
    c->body += n;
    c->left -= n;
    lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, BODY_TIME);  // else 5 s for all of it
    if (lws_write(wsi, buffer + LWS_PRE, n, c->left ? LWS_WRITE_HTTP : LWS_WRITE_HTTP_FINAL) <
        (int)n)
        return -1;
    if (c->left == 0) return lws_http_transaction_completed(wsi) ? -1 : 0;
    lws_callback_on_writable(wsi);
    return 0;
}

// ---- a page --------------------------------------------------------------------------------------------------

static bool has_control(const OmViewServer* s, const struct lws* wsi) {
    return s->nclient > 0 && s->page[0] == wsi;
}

// The next message for a client, copied behind LWS_PRE bytes; null: it has all. The mutex is held.
static unsigned char* next_message(OmViewServer* s, struct lws* wsi, Client* c, size_t* size,
                                   bool* is_text) {
    char control[96];
    const bool has = has_control(s, wsi);
    Message m = {0};
    if (!c->was_told || has != c->has_control) {
        snprintf(control, sizeof control, "{\"control\":%s}", has ? "true" : "false");
        m = (Message){control, strlen(control)};
        c->was_told = true;
        c->has_control = has;
    } else if (c->generation != s->generation) {
        snprintf(control, sizeof control, "{\"clear\":true}");
        m = (Message){control, strlen(control)};
        c->generation = s->generation;
        c->nlasting = 0;
    } else if (c->nleft_out > 0) {
        snprintf(control, sizeof control, "{\"say\":\"%s\",\"is_error\":true}", TOO_MANY);
        m = (Message){control, strlen(control)};
        --c->nleft_out;
    } else if (c->nlasting < s->nlasting) {
        m = s->lasting[c->nlasting++];
    } else {  // the status first: it is rare
        for (int k = NNEWEST - 1; k >= 0 && !m.data; --k) {
            if (c->number[k] == s->number[k]) continue;
            m = s->newest[k];
            c->number[k] = s->number[k];
        }
    }
    if (!m.data) return NULL;
    unsigned char* copy = om_alloc(LWS_PRE + m.size, 1);
    if (!copy) return NULL;
    memcpy(copy + LWS_PRE, m.data, m.size);
    *size = m.size;
    *is_text = m.data[0] == '{';
    return copy;
}

static int write_page(OmViewServer* s, struct lws* wsi, Client* c) {
    size_t size = 0;
    bool is_text = false;
    pthread_mutex_lock(&s->mutex);
    unsigned char* m = next_message(s, wsi, c, &size, &is_text);
    pthread_mutex_unlock(&s->mutex);
    if (!m) return 0;
    const int n = lws_write(wsi, m + LWS_PRE, size, is_text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY);
    om_free(m);
    if (n < (int)size) return -1;
    lws_callback_on_writable(wsi);
    return 0;
}

static void open_page(OmViewServer* s, struct lws* wsi, Client* c) {
    pthread_mutex_lock(&s->mutex);
    c->is_page = s->nclient < MAX_CLIENT;
    if (c->is_page) s->page[s->nclient++] = wsi;
    if (s->nclient == 1) s->heard = om_clock_now();
    c->generation = s->generation;
    pthread_mutex_unlock(&s->mutex);
    lws_callback_on_writable(wsi);
}

// Of the pages that are left, the one that was opened first has the controls now.
static void close_page(OmViewServer* s, struct lws* wsi, Client* c) {
    if (!c->is_page) return;
    c->is_page = false;
    pthread_mutex_lock(&s->mutex);
    int k = 0;
    while (k < s->nclient && s->page[k] != wsi) ++k;
    if (k == 0) s->heard = om_clock_now();  // the next one has time to speak
    for (--s->nclient; k < s->nclient; ++k) s->page[k] = s->page[k + 1];
    struct lws* next = s->nclient > 0 ? s->page[0] : NULL;
    pthread_mutex_unlock(&s->mutex);
    if (next) lws_callback_on_writable(next);
}

// A page that speaks gets the controls of one that has been silent: a hidden tab, a lost connection. The mutex is held.
static void take_control(OmViewServer* s, struct lws* wsi) {
    int k = 0;
    if (om_clock_now() - s->heard < OM_VIEW_SILENCE) return;
    while (k < s->nclient && s->page[k] != wsi) ++k;
    if (k == 0 || k == s->nclient) return;
    lws_callback_on_writable(s->page[0]);
    for (; k > 0; --k) s->page[k] = s->page[k - 1];
    s->page[0] = wsi;
    lws_callback_on_writable(wsi);
}

static bool is_move(const char* line) { return strncmp(line, "move ", 5) == 0; }

static bool is_stop(const char* line) {
    static const char* const word[] = {"pause", "release", "cancel", "abort"};
    for (size_t k = 0; k < sizeof word / sizeof *word; ++k)
        if (strcmp(line, word[k]) == 0) return true;
    return false;
}

// Of moves in a row the last one counts. The mutex is held. @return false: there is no place
static bool queue_line(OmViewServer* s, const Client* c) {
    const int last = (s->first + s->nline - 1 + MAX_LINES) % MAX_LINES;
    const bool replaces = s->nline > 0 && is_move(s->line[last]) && is_move(c->line);
    const int most = is_stop(c->line) ? MAX_LINES : MAX_LINES - KEPT_LINES;
    if (!replaces && s->nline >= most) return false;
    const int at = replaces ? last : (s->first + s->nline++) % MAX_LINES;
    memcpy(s->line[at], c->line, c->nline + 1);
    return true;
}

// A whole line of a page. Of one without the controls it is left out.
static void take_line(OmViewServer* s, struct lws* wsi, Client* c) {
    pthread_mutex_lock(&s->mutex);
    take_control(s, wsi);
    if (has_control(s, wsi)) {
        s->heard = om_clock_now();
        const bool is_plain = om_text_is_plain(c->line, c->nline, NULL);
        const bool is_left_out = is_plain && strcmp(c->line, "beat") != 0 && !queue_line(s, c);
        if (is_left_out && c->nleft_out < MAX_LINES) ++c->nleft_out;
        if (is_left_out) lws_callback_on_writable(wsi);
    }
    pthread_mutex_unlock(&s->mutex);
}

// Messages arrive in parts. One that is too long closes the page.
static int receive(OmViewServer* s, struct lws* wsi, Client* c, const char* data, size_t size) {
    if (lws_frame_is_binary(wsi) || c->nline + size > OM_VIEW_MAX_LINE) return -1;
    memcpy(c->line + c->nline, data, size);
    c->nline += size;
    c->line[c->nline] = 0;
    if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
    take_line(s, wsi, c);
    c->nline = 0;
    return 0;
}

static int on_event(struct lws* wsi, enum lws_callback_reasons reason, void* user, void* in,
                    size_t len);

static const struct lws_protocols protocol[] = {
    {"omentum", on_event, sizeof(Client), OM_VIEW_MAX_LINE + 1, 0, NULL, 0},
    {NULL, NULL, 0, 0, 0, NULL, 0},
};

static int on_event(struct lws* wsi, enum lws_callback_reasons reason, void* user, void* in,
                    size_t len) {
    OmViewServer* s = lws_context_user(lws_get_context(wsi));
    Client* c = user;
    switch (reason) {
    case LWS_CALLBACK_HTTP: return answer(s, wsi, c, in);
    case LWS_CALLBACK_HTTP_WRITEABLE: return c && c->left ? write_body(wsi, c) : 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return is_welcome(s, wsi) && !s->file && s->nclient < MAX_CLIENT ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED: open_page(s, wsi, c); return 0;
    case LWS_CALLBACK_CLOSED: close_page(s, wsi, c); return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE: return write_page(s, wsi, c);
    case LWS_CALLBACK_RECEIVE: return receive(s, wsi, c, in, len);
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        lws_callback_on_writable_all_protocol(s->lws, &protocol[0]);
        return 0;
    default: return 0;
    }
}

// ---- the server ----------------------------------------------------------------------------------------------

static OmStatus serve(void* ctx, const OmProgress* progress) {
    OmViewServer* s = ctx;
    (void)progress;
    while (!atomic_load(&s->is_ending) && lws_service(s->lws, 0) >= 0) {
    }
    return OM_OK;
}

OmViewServerDef om_view_server_default_def(void) {
    return (OmViewServerDef){
        .cookie = COOKIE, .address = "127.0.0.1", .port = 8765, .title = "omentum"};
}

static OmStatus check_def(const OmViewServerDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "OmViewServerDef was not made by default_def");
    OM_CHECK(d->address && d->address[0] && strlen(d->address) < 64, OM_INVALID,
             "OmViewServerDef.address is no address");
    OM_CHECK(d->port >= 0 && d->port <= 65535, OM_INVALID, "port %d: 0 to 65535", d->port);
    OM_CHECK(is_loopback(d->address) || (d->token && d->token[0]), OM_INVALID,
             "others than this machine can reach %s: a token is needed; --token WORD sets it",
             d->address);
    for (const char* t = d->token ? d->token : ""; *t; ++t)
        OM_CHECK(isalnum((unsigned char)*t), OM_INVALID, "a token has letters and digits alone");
    OM_CHECK(!d->token || strlen(d->token) < 64, OM_INVALID, "a token has at most 63 characters");
    return OM_OK;
}

static OmStatus start(const OmViewServerDef* d, OmViewServer* s) {
    struct lws_context_creation_info info = {0};
    info.port = d->port;
    info.iface = strcmp(d->address, "localhost") == 0 ? "127.0.0.1" : d->address;
    info.protocols = protocol;
    info.user = s;
    info.gid = (gid_t)-1;
    info.uid = (uid_t)-1;
    info.alpn = "http/1.1";
    info.server_string = "omentum";
    lws_set_log_level(0, NULL);
    // a vhost of its own: the library leaks where the port of its default vhost is taken
    info.options |= LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
    s->lws = lws_create_context(&info);
    OM_CHECK(s->lws, OM_NO_MEMORY, "out of memory for a server");
    OM_CHECK(
        lws_create_vhost(s->lws, &info), OM_IO,
        "cannot listen on %s, port %d: the address is not of this machine, or the port is taken; "
        "--port 0 takes a free one",
        d->address, d->port);
    const int port = lws_get_vhost_listen_port(lws_get_vhost_by_name(s->lws, "default"));
    snprintf(s->url, sizeof s->url, "http://%s:%d/%s%s", d->address, port,
             s->token[0] ? "?token=" : "", s->token);
    return om_job_start(serve, s, &s->job);
}

OmStatus om_view_server_create(const OmViewServerDef* def, OmViewServer** server) {
    *server = NULL;
    OM_TRY(check_def(def));
    OmViewServer* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OmText html = {0};
    pthread_mutex_init(&s->mutex, NULL);
    snprintf(s->address, sizeof s->address, "%s", def->address);
    snprintf(s->token, sizeof s->token, "%s", def->token ? def->token : "");
    OmStatus status = OM_OK;
    if (def->file) OM_TRY_DONE(om_file_read(def->file, (size_t)1 << 30, &s->file, &s->file_size));
    OM_TRY_DONE(om__view_live_page(def->title, &html));
    s->html = html.str;
    s->html_size = html.len;
    html = (OmText){0};
    status = start(def, s);
done:
    om_text_done(&html);
    if (status < 0)
        om_view_server_destroy(s);
    else
        *server = s;
    return status;
}

void om_view_server_destroy(OmViewServer* s) {
    if (!s) return;
    atomic_store(&s->is_ending, true);
    if (s->lws) lws_cancel_service(s->lws);
    om_job_join(s->job);
    if (s->lws) lws_context_destroy(s->lws);
    om_view_server_clear(s);
    om_free(s->lasting);
    om_free(s->html);
    om_free(s->file);
    pthread_mutex_destroy(&s->mutex);
    om_free(s);
}

const char* om_view_server_url(const OmViewServer* s) { return s->url; }

// ---- the program's side --------------------------------------------------------------------------------------

static OmStatus keep_lasting(OmViewServer* s, Message m) {
    OM_GROW(s->lasting, s->nlasting, s->capacity, 64);
    s->lasting[s->nlasting++] = m;
    return OM_OK;
}

OmStatus om_view_server_publish(OmViewServer* s, OmViewChannel channel, const char* data,
                                size_t size) {
    // the length in front of a binary message is that of its file; a WebSocket has its own
    if (size > 4 && data[0] != '{') data += 4, size -= 4;
    Message m = {om_alloc(size + 1, 1), size};
    if (!m.data) return OM_NO_MEMORY;
    memcpy(m.data, data, size);
    OmStatus status = OM_OK;
    pthread_mutex_lock(&s->mutex);
    if (channel == OM_VIEW_LASTING) {
        status = keep_lasting(s, m);
        if (status < 0) om_free(m.data);
    } else {
        const int k = channel - OM_VIEW_NEWEST;
        om_free(s->newest[k].data);
        s->newest[k] = m;
        ++s->number[k];
    }
    pthread_mutex_unlock(&s->mutex);
    lws_cancel_service(s->lws);
    return status;
}

void om_view_server_clear(OmViewServer* s) {
    pthread_mutex_lock(&s->mutex);
    for (int i = 0; i < s->nlasting; ++i) om_free(s->lasting[i].data);
    s->nlasting = 0;
    ++s->generation;
    for (int k = 0; k < NNEWEST; ++k) {
        om_free(s->newest[k].data);
        s->newest[k] = (Message){0};
    }
    pthread_mutex_unlock(&s->mutex);
}

bool om_view_server_next(OmViewServer* s, char* line, size_t size) {
    pthread_mutex_lock(&s->mutex);
    const bool is_there = s->nline > 0;
    if (is_there) {
        snprintf(line, size, "%s", s->line[s->first]);
        s->first = (s->first + 1) % MAX_LINES;
        --s->nline;
    }
    pthread_mutex_unlock(&s->mutex);
    return is_there;
}

int om_view_server_count(OmViewServer* s) {
    pthread_mutex_lock(&s->mutex);
    const int n = s->nclient;
    pthread_mutex_unlock(&s->mutex);
    return n;
}

double om_view_server_silence(OmViewServer* s) {
    pthread_mutex_lock(&s->mutex);
    const double silence = s->heard > 0 ? om_clock_now() - s->heard : (double)INFINITY;
    pthread_mutex_unlock(&s->mutex);
    return silence;
}
