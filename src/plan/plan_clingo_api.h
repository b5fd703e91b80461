/// plan_clingo_api.h: the functions of libclingo 5.4 that plan_clingo.c calls.
///
/// Debian's package `gringo` has the library without its header. These are the documented signatures and values
/// of version 5.4; only plan_clingo.c includes this file.
#ifndef OM_PLAN_CLINGO_API_H
#define OM_PLAN_CLINGO_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef uint64_t clingo_symbol_t;
typedef uint64_t clingo_signature_t;
typedef uint64_t clingo_symbolic_atom_iterator_t;
typedef int32_t clingo_literal_t;
typedef struct clingo_control clingo_control_t;
typedef struct clingo_symbolic_atoms clingo_symbolic_atoms_t;
typedef struct clingo_model clingo_model_t;
typedef struct clingo_solve_handle clingo_solve_handle_t;

enum { clingo_error_bad_alloc = 3 };
enum { clingo_warning_runtime_error = 1, clingo_warning_atom_undefined = 2 };
enum { clingo_truth_value_true = 1, clingo_truth_value_false = 2 };
enum {
    clingo_symbol_type_number = 1,
    clingo_symbol_type_string = 4,
    clingo_symbol_type_function = 5
};
enum { clingo_show_type_shown = 2 };
enum { clingo_solve_mode_async = 1 };
enum { clingo_solve_event_type_model = 0 };
enum {
    clingo_solve_result_satisfiable = 1,
    clingo_solve_result_unsatisfiable = 2,
    clingo_solve_result_exhausted = 4,
    clingo_solve_result_interrupted = 8,
};

typedef struct clingo_location clingo_location_t;
typedef struct clingo_part {
    const char* name;
    const clingo_symbol_t* params;
    size_t size;
} clingo_part_t;

typedef void (*clingo_logger_t)(int code, const char* message, void* data);
typedef bool (*clingo_symbol_callback_t)(const clingo_symbol_t* symbols, size_t size, void* data);
typedef bool (*clingo_ground_callback_t)(const clingo_location_t* location, const char* name,
                                         const clingo_symbol_t* arguments, size_t arguments_size,
                                         void* data, clingo_symbol_callback_t symbol_callback,
                                         void* symbol_callback_data);
typedef bool (*clingo_solve_event_callback_t)(unsigned type, void* event, void* data, bool* goon);

int clingo_error_code(void);
const char* clingo_error_message(void);

bool clingo_signature_create(const char* name, uint32_t arity, bool positive,
                             clingo_signature_t* signature);
void clingo_symbol_create_number(int number, clingo_symbol_t* symbol);
bool clingo_symbol_create_function(const char* name, const clingo_symbol_t* arguments,
                                   size_t arguments_size, bool positive, clingo_symbol_t* symbol);
bool clingo_parse_term(const char* string, clingo_logger_t logger, void* logger_data,
                       unsigned message_limit, clingo_symbol_t* symbol);
int clingo_symbol_type(clingo_symbol_t symbol);
bool clingo_symbol_number(clingo_symbol_t symbol, int* number);
bool clingo_symbol_name(clingo_symbol_t symbol, const char** name);
bool clingo_symbol_string(clingo_symbol_t symbol, const char** string);
bool clingo_symbol_arguments(clingo_symbol_t symbol, const clingo_symbol_t** arguments,
                             size_t* size);

bool clingo_control_new(const char* const* arguments, size_t arguments_size, clingo_logger_t logger,
                        void* logger_data, unsigned message_limit, clingo_control_t** control);
void clingo_control_free(clingo_control_t* control);
bool clingo_control_load(clingo_control_t* control, const char* file);
bool clingo_control_add(clingo_control_t* control, const char* name, const char* const* parameters,
                        size_t parameters_size, const char* program);
bool clingo_control_ground(clingo_control_t* control, const clingo_part_t* parts, size_t parts_size,
                           clingo_ground_callback_t ground_callback, void* ground_callback_data);
bool clingo_control_solve(clingo_control_t* control, unsigned mode,
                          const clingo_literal_t* assumptions, size_t assumptions_size,
                          clingo_solve_event_callback_t notify, void* data,
                          clingo_solve_handle_t** handle);
bool clingo_control_assign_external(clingo_control_t* control, clingo_literal_t literal, int value);
bool clingo_control_symbolic_atoms(const clingo_control_t* control,
                                   const clingo_symbolic_atoms_t** atoms);

bool clingo_symbolic_atoms_begin(const clingo_symbolic_atoms_t* atoms,
                                 const clingo_signature_t* signature,
                                 clingo_symbolic_atom_iterator_t* iterator);
bool clingo_symbolic_atoms_next(const clingo_symbolic_atoms_t* atoms,
                                clingo_symbolic_atom_iterator_t iterator,
                                clingo_symbolic_atom_iterator_t* next);
bool clingo_symbolic_atoms_is_valid(const clingo_symbolic_atoms_t* atoms,
                                    clingo_symbolic_atom_iterator_t iterator, bool* valid);
bool clingo_symbolic_atoms_find(const clingo_symbolic_atoms_t* atoms, clingo_symbol_t symbol,
                                clingo_symbolic_atom_iterator_t* iterator);
bool clingo_symbolic_atoms_symbol(const clingo_symbolic_atoms_t* atoms,
                                  clingo_symbolic_atom_iterator_t iterator,
                                  clingo_symbol_t* symbol);
bool clingo_symbolic_atoms_literal(const clingo_symbolic_atoms_t* atoms,
                                   clingo_symbolic_atom_iterator_t iterator,
                                   clingo_literal_t* literal);
bool clingo_symbolic_atoms_is_external(const clingo_symbolic_atoms_t* atoms,
                                       clingo_symbolic_atom_iterator_t iterator, bool* external);

bool clingo_model_symbols_size(const clingo_model_t* model, unsigned show, size_t* size);
bool clingo_model_symbols(const clingo_model_t* model, unsigned show, clingo_symbol_t* symbols,
                          size_t size);
bool clingo_model_cost_size(const clingo_model_t* model, size_t* size);
bool clingo_model_cost(const clingo_model_t* model, int64_t* costs, size_t size);

bool clingo_solve_handle_get(clingo_solve_handle_t* handle, unsigned* result);
void clingo_solve_handle_wait(clingo_solve_handle_t* handle, double timeout, bool* result);
bool clingo_solve_handle_cancel(clingo_solve_handle_t* handle);
bool clingo_solve_handle_close(clingo_solve_handle_t* handle);

#endif
