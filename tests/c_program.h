/* Checks of the C interface (c_program.c). Each returns 0, or the number of the line that went wrong. */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif
/* `path`: name of a file that the check may write. */
int c_program_reads_and_restores(void);
int c_program_hears_why(void);
int c_program_finds_all_as_it_was(void);
int c_program_goes_to_coefficients_and_back(void);
int c_program_names_contacts(void);
int c_program_moves_a_group(void);
int c_program_twists_a_pad(void);
int c_program_asks_what_it_runs_on(void);
int c_program_watches_a_deadline(void);
#ifdef __cplusplus
}
#endif
