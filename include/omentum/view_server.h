/// omentum/view_server.h: the page of a view over HTTP, and its messages over a WebSocket (room `view`, floor 5).
///
/// A thread of its own owns the sockets. The program publishes messages and takes the lines that the page sends, and
/// never waits for a client. Of frames a client gets the newest when it is ready: a slow one gets fewer, never a queue.
///
///     OmViewServerDef def = om_view_server_default_def();
///     OmViewServer* server;
///     om_view_server_create(&def, &server);
///     puts(om_view_server_url(server));
///     om_view_server_publish(server, OM_VIEW_LASTING, scene.str, scene.len);
///     while (...) {
///         om_view_server_publish(server, OM_VIEW_NEWEST, frame.str, frame.len);
///         while (om_view_server_next(server, line, sizeof line)) ...
///     }
///     om_view_server_destroy(server);
///
/// The first page has the controls: only its lines reach the program. Others watch; the next one gets them when it is
/// closed, or was silent for two seconds. A page says "beat" twice a second. Of "move" lines in a row the last is kept.
/// At most 60 lines wait for the program, and 64 with "pause", "release", "cancel" and "abort". A line that finds no
/// place is left out, and its page gets {"say":"too many commands; the last was left out","is_error":true}.
///
/// Safety: the server listens on this machine alone unless `address` says otherwise, and then needs a token. Requests
/// with another Host or Origin are refused (a web page of a stranger could send them), scripts come from the server
/// alone (CSP), lines are at most OM_VIEW_MAX_LINE bytes.
#ifndef OMENTUM_VIEW_SERVER_H
#define OMENTUM_VIEW_SERVER_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_VIEW_MAX_LINE 1000  // bytes of a line from a page
#define OM_VIEW_SILENCE 2.0    // s after which a page with the controls counts as gone

typedef struct OmViewServerDef {
    OmCookie cookie;
    const char* address;  // of an interface; default "127.0.0.1": this machine alone
    int port;             // default 8765; 0: any that is free
    const char* token;    // that a page must know; default null: none, for loopback alone
    const char* title;    // of the page; default "omentum"
    const char* file;     // a page to serve, as view.html of a run; default null: the live one
} OmViewServerDef;

OM_API OmViewServerDef om_view_server_default_def(void);

typedef struct OmViewServer OmViewServer;
/// @return OM_OK; OM_INVALID (a field; another address than loopback without a token); OM_IO (the port is taken, the
///         file cannot be read); OM_NO_MEMORY
OM_API OmStatus om_view_server_create(const OmViewServerDef* def, OmViewServer** server);
/// Closes all connections. Null is fine.
OM_API void om_view_server_destroy(OmViewServer* server);
/// Where the page is, with its token; valid until the server is destroyed.
OM_API const char* om_view_server_url(const OmViewServer* server);

typedef enum OmViewChannel {
    OM_VIEW_LASTING,  // each page gets all of them, in order: scene, points, decisions
    OM_VIEW_NEWEST,   // a page gets the last one
    OM_VIEW_STATUS    // the same, for a line of JSON that does not take a frame's place
} OmViewChannel;
/// @param data  one message of view.h, with its length in front, or a line of JSON that begins with {
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view_server_publish(OmViewServer* server, OmViewChannel channel,
                                       const char* data, size_t size);
/// Forget the lasting messages: another scene follows.
OM_API void om_view_server_clear(OmViewServer* server);
/// The next line of the page that has the controls. @return false: there is none
OM_API bool om_view_server_next(OmViewServer* server, char* line, size_t size);
/// Pages that are open.
OM_API int om_view_server_count(OmViewServer* server);
/// s since a page with the controls was heard, or was closed; INFINITY: there was none yet
OM_API double om_view_server_silence(OmViewServer* server);

#ifdef __cplusplus
}
#endif
#endif
