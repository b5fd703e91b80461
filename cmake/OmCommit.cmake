# cmake -D SOURCE=DIR -D OUT=FILE [-D COMMIT=TEXT] -P OmCommit.cmake: the header with the commit of the checkout, written
# again only where it has changed. "unknown" outside of a checkout, unless COMMIT says it.
set(commit "${COMMIT}")
if(NOT commit AND EXISTS ${SOURCE}/.git)
    execute_process(COMMAND git describe --always --dirty --abbrev=8 --exclude=* WORKING_DIRECTORY ${SOURCE}
                    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT commit)
    set(commit unknown)
endif()
set(text "// Written by cmake/OmCommit.cmake.\n#define OM_COMMIT \"${commit}\"\n")
set(now "")
if(EXISTS ${OUT})
    file(READ ${OUT} now)
endif()
if(NOT now STREQUAL text)
    file(WRITE ${OUT} "${text}")
endif()
