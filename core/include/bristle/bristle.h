/* bristle for C99, and for languages that call C: C#, Rust, Python.
 *
 * Units are SI, forces act ON the moving body. The C++ headers in this folder say what the numbers mean; this
 * one says how they are passed.
 *
 * Results. A function that can fail returns a bristle_result, unless its comment says otherwise. Outputs are
 * written only with BRISTLE_OK, but for bristle_joint_step::status, which BRISTLE_REFUSED may write too.
 * bristle_last_error() is the text of the calling thread's last failure. No exception leaves a function, and
 * no call ends the program. A null pointer where one is not allowed gives BRISTLE_BAD_ARGUMENT.
 *
 * Sizes of structs. Structs with a `struct_size` are filled with defaults by their bristle_init_...()
 * function, which also sets that size; arrays of motions, responses and patch options are passed with the
 * size of one element. Another size than the library's is refused, because the program was compiled with
 * another header. The other structs never change.
 *
 * Enumerations are passed as uint32_t. Every handle is opaque and owned by its creator; names and kernel
 * texts stay valid until the program ends.
 *
 * Thread rules, by the word at the end of each function's comment:
 *   [any]      may be called by any thread at any time.
 *   [step]     the stepping thread of this batch: one thread at a time.
 *   [change]   one other thread (or the same one) may call these while the stepping thread steps. They
 *              allocate and free memory; the next [step] function executes all changes that wait.
 *   [alone]    only while no other call on this handle runs.
 *
 * Functions of beds, joints and outlines are in libraries built with these (config.hpp).
 *
 * [step] functions allocate only to warm up, to restore a state, to report a failure, or where they say so.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "bristle/config.hpp"
#include "bristle/export.hpp"
#include "bristle/version.hpp"

/* Marks structs that the library reads where they are, as its own C++ structs. */
#if defined(__GNUC__)
#define BRISTLE_SHARED_LAYOUT __attribute__((may_alias))
#else
#define BRISTLE_SHARED_LAYOUT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/** @file
 *  @brief The C interface. */

/* ------------------------------------------------------------------------------------------- results */

/** The result of a call: one of the values below. */
typedef int32_t bristle_result;

/** Values of bristle_result. */
enum {
  BRISTLE_OK = 0,
  BRISTLE_BAD_ARGUMENT = 1, /**< a null pointer, or a struct size other than the library's */
  BRISTLE_REFUSED = 2,      /**< a parameter out of range, an unknown id: the text says which */
  BRISTLE_OUT_OF_MEMORY = 3,
  BRISTLE_WRONG_BUILD = 4, /**< headers and library do not belong together */
  BRISTLE_FAILED = 5       /**< anything else */
};

/** Returns the name of a result, "BRISTLE_OK" and so on. [any] */
BRISTLE_API const char* bristle_result_name(bristle_result result);

/** Returns the reason, in one line, for the last failed call of the calling thread; "" if none failed. Valid
 * until that thread's next failure. [any] */
BRISTLE_API const char* bristle_last_error(void);

/** "major.minor.patch" of the library. [any] */
BRISTLE_API const char* bristle_version(void);

/** Returns BRISTLE_WRONG_BUILD if headers and library do not belong together; bristle_last_error names the
 * difference. Call it first: bristle_check_build(BRISTLE_VERSION_NUMBER, BRISTLE_BUILD_OPTIONS). [any] */
BRISTLE_API bristle_result bristle_check_build(uint32_t version_number, uint32_t build_options);

/** Number of instruction sets of this build, best first. [any] */
BRISTLE_API size_t bristle_instruction_set_count(void);

/** Returns the name of an instruction set, null past the last one; `usable` (may be null): 1 if this machine
 * supports it. [any] */
BRISTLE_API const char* bristle_instruction_set(size_t index, uint32_t* usable);

/* ----------------------------------------------------------------------------------------- materials */

/** Families of snap lengths: bristle::SnapLaw. */
enum {
  BRISTLE_LAW_SINGLE = 0,      /**< first parameter: length, m */
  BRISTLE_LAW_UNIFORM = 1,     /**< least and greatest length, m */
  BRISTLE_LAW_NORMAL = 2,      /**< mean and deviation before the cut at 0, m */
  BRISTLE_LAW_LOGNORMAL = 3,   /**< mean, m, and coefficient of variation */
  BRISTLE_LAW_EXPONENTIAL = 4, /**< mean, m */
  BRISTLE_LAW_TABLE = 5        /**< quantiles in `table`, m */
};
/** Behaviour of a bristle at its snap length: bristle::SnapRule. */
enum { BRISTLE_RULE_REDRAW = 0, BRISTLE_RULE_KEEP = 1, BRISTLE_RULE_SLIDE = 2 };
/** Decay of the bristle damper with speed: bristle::DamperDecay. */
enum { BRISTLE_DECAY_EXPONENTIAL = 0, BRISTLE_DECAY_GAUSSIAN = 1 };

/** The law of the snap length: bristle::SnapLength. The struct never changes. */
typedef struct bristle_snap_length {
  uint32_t law;            /**< BRISTLE_LAW_... */
  uint32_t table_size;     /**< length of `table`, 2 to 257; not read for other laws */
  double first_parameter;  /**< see BRISTLE_LAW_... */
  double second_parameter; /**< 0 if the law has only one */
  const double* table;     /**< the caller's array, read during the call only */
} bristle_snap_length;

/** Growth g of the snap length with age a: 1 + strength ln(1 + a / time), or
 * 1 + strength (1 - exp(-a / time)): bristle::AgeingForm. */
enum { BRISTLE_AGEING_LOGARITHMIC = 0, BRISTLE_AGEING_SATURATING = 1 };

/** Bristle parameters: bristle::Material. */
typedef struct bristle_material {
  size_t struct_size;
  double bristle_stiffness;         /**< N/m. sigma0: one bristle, tangential. */
  double bristle_damping;           /**< N s/m. sigma1: damper of one bristle at rest. */
  double viscous_friction;          /**< N s/m. sigma2: lubricant term of the patch. */
  double stribeck_velocity;         /**< m/s. vs: decay of dampers; 0 = no damper. */
  double normal_stiffness;          /**< N/m. sigma_perp: one bristle, normal. */
  double asperity_height_deviation; /**< m. sigma: deviation of the asperities' heights. */
  bristle_snap_length snap_length;  /**< SnapLength: law of the deflection at which a bristle snaps. */
  uint32_t snap_rule;    /**< 0 redraw, 1 keep, 2 slide: behaviour of a bristle at its snap length */
  uint32_t damper_decay; /**< 0 exponential, 1 gaussian: decay of the dampers with speed */
  /** m. A bristle snaps at this plus its snap length, and stays bent by this. At most 64 mean snap lengths.
   */
  double residual_length;
  double shared_renewal; /**< Bristles that a snap renews in the patch. */
  /** 0 logarithmic, 1 saturating: how a snap length grows while a bristle sticks */
  uint32_t ageing_form;
  double ageing_strength;     /**< beta or gain; 0 = no ageing. */
  double ageing_time;         /**< s. tau. */
  double speed_strengthening; /**< a: a N asinh(v / (2 v*)) against the motion; 0 = none. */
  double strengthening_speed; /**< m/s. v*. */
  double drop; /**< Snap rule "slide": share of its limit that a bristle loses while it slides. */
} bristle_material;

/** The usual coefficients of a pair of surfaces: bristle::Coefficients. */
typedef struct bristle_coefficients {
  size_t struct_size;
  double kinetic; /**< Friction over normal load in slow sliding. */
  double peak;    /**< Highest friction over normal load at first loading; 0 = what follows from spread. */
  double presliding_length;   /**< m. Mean deflection at a snap. */
  double bristles_per_newton; /**< 1/N. Bristles in contact over normal load. */
  double damping_per_newton;  /**< s/m. Tangential damping at rest over load. */
  double viscous_friction;    /**< N s/m. Lubricant term of the patch. */
  double stribeck_velocity;   /**< m/s. Speed of the dampers' decay. */
  /** 0 single, 1 uniform, 2 normal, 3 lognormal, 4 exponential, 5 table: family of snap lengths; peak /
   * kinetic sets its spread, or spread does */
  uint32_t law;
  uint32_t rule;         /**< 0 redraw, 1 keep, 2 slide: behaviour of a bristle at its snap length */
  uint32_t damper_decay; /**< 0 exponential, 1 gaussian: decay of the dampers with speed */
  double residual_share; /**< Share of the presliding length that a snap leaves. */
  double shared_renewal; /**< Bristles that a snap renews in the patch. */
  /** m/s. Speed at which kinetic and peak apply; 0 = so fast that nothing ages. */
  double kinetic_speed;
  /** Share of kinetic friction that is lost per decade of speed; 0 = no ageing. */
  double fall_per_decade;
  double growth_per_decade; /**< Instead: growth of static friction per decade of rest, over kinetic. */
  double ageing_time;       /**< s. tau. */
  /** 0 logarithmic, 1 saturating: how a snap length grows while a bristle sticks */
  uint32_t ageing_form;
  /** a: a N asinh(v / (2 v*)) against the motion; 0 = none. Not part of kinetic. */
  double speed_strengthening;
  double strengthening_speed; /**< m/s. v*. */
  /** Standard deviation over mean of the snap length (normal: of the uncut law); 0 = solved from peak. Beside
   * a peak the two must agree. */
  double spread;
  /** Rule "slide": share of its limit that a bristle loses while it slides; 0 = solved from peak. */
  double drop;
} bristle_coefficients;

/** Coefficients and lengths that follow from a material. */
typedef struct bristle_material_facts {
  size_t struct_size;
  double kinetic_coefficient;   /**< friction over normal load in sliding, without dampers and ageing */
  double peak_coefficient;      /**< highest friction over normal load at first loading */
  double bristles_per_newton;   /**< zeta / N, 1/N */
  double mean_snap_length;      /**< m */
  double snap_length_variation; /**< coefficient of variation */
  double longest_snap_length;   /**< m, the longest length sampled */
} bristle_material_facts;

/** Fills `material` with the defaults of bristle::Material. `struct_size` is sizeof *material. [any] */
BRISTLE_API bristle_result bristle_init_material(bristle_material* material, size_t struct_size);
/** Fills `coefficients` with the defaults of bristle::Coefficients. [any] */
BRISTLE_API bristle_result bristle_init_coefficients(bristle_coefficients* coefficients, size_t struct_size);
/** Sets `facts` to zeros. [any] */
BRISTLE_API bristle_result bristle_init_material_facts(bristle_material_facts* facts, size_t struct_size);

/** Returns the name of a pair of surfaces with coefficients to start from (bristle::typical_materials()), or
 * null if `index` is not below the number of pairs. The name lives for ever. [any] */
BRISTLE_API const char* bristle_typical_name(size_t index);
/** Fills `coefficients`, which must be initialised, with those of a pair of surfaces. Refuses an unknown
 * name; the error lists the known ones. [any] */
BRISTLE_API bristle_result bristle_typical_coefficients(const char* name, bristle_coefficients* coefficients);

/** Calculates bristle parameters from coefficients; `material` must be initialised. Refuses a ratio of peak
 * to kinetic that the family cannot reach, naming the range. Set-up cost. [any] */
BRISTLE_API bristle_result bristle_material_from_coefficients(const bristle_coefficients* coefficients,
                                                              bristle_material* material);
/** Calculates the coefficients of a material at coefficients->kinetic_speed; `coefficients` must be
 * initialised. Set-up cost. [any] */
BRISTLE_API bristle_result bristle_material_to_coefficients(const bristle_material* material,
                                                            bristle_coefficients* coefficients);
/** Refuses a material by naming its first parameter out of range. [any] */
BRISTLE_API bristle_result bristle_material_check(const bristle_material* material);
/** Calculates the facts of a material; `facts` must be initialised. Set-up cost. [any] */
BRISTLE_API bristle_result bristle_material_find_facts(const bristle_material* material,
                                                       bristle_material_facts* facts);
/** Calculates steady friction (N) under a load (N) at each of `count` speeds (m/s). [any] */
BRISTLE_API bristle_result bristle_material_steady_force(const bristle_material* material,
                                                         double normal_load_n, const double* speeds,
                                                         double* forces, size_t count);
/** Calculates the bristles' friction over normal load in steady sliding at each of `count` speeds (m/s),
 * without dampers and strengthening. With ageing it falls with the speed. [any] */
BRISTLE_API bristle_result bristle_material_kinetic_at(const bristle_material* material, const double* speeds,
                                                       double* coefficients, size_t count);
/** Calculates the damper of one bristle (N s/m) at each of `count` speeds (m/s). [any] */
BRISTLE_API bristle_result bristle_material_damping(const bristle_material* material, const double* speeds,
                                                    double* dampings, size_t count);
/** Calculates the mean deflection at first loading, at given displacements, all in mean snap lengths: see
 *  bristle::virgin_deflection. Set-up cost for each. [any] */
BRISTLE_API bristle_result bristle_material_virgin_deflection(const bristle_material* material,
                                                              const double* displacements,
                                                              double* deflections, size_t count);
/** Calculates quantiles of the snap length (m) at shares in (0, 1). [any] */
BRISTLE_API bristle_result bristle_snap_length_quantile(const bristle_snap_length* snap_length,
                                                        const double* shares, double* lengths, size_t count);
/** Calculates P(snap length > x) at lengths x (m). [any] */
BRISTLE_API bristle_result bristle_snap_length_survival(const bristle_snap_length* snap_length,
                                                        const double* lengths, double* shares, size_t count);
/** Calculates E[delta^k] and, at lengths x (m), E[delta^k; delta < x] (m^k). k = 0..6; with lengths k = 0..2.
 * `moment` may be null, `count` may be 0. [any] */
BRISTLE_API bristle_result bristle_snap_length_moment(const bristle_snap_length* snap_length, int32_t k,
                                                      double* moment, const double* lengths, double* partial,
                                                      size_t count);

/* ------------------------------------------------------------------------------------------- batches */

/** Contact patches stepped together: bristle::PatchBatch. */
typedef struct bristle_batch bristle_batch;

/** Names a patch of one batch; 0 = none. A removed id never names a later patch. */
typedef uint64_t bristle_id;

/** Options of a batch: bristle::BatchOptions. */
typedef struct bristle_batch_options {
  size_t struct_size;
  /** Instruction set of the kernels; none = BRISTLE_ISA, or the best of this machine. */
  const char* isa;
  int32_t threads; /**< Threads that may step, the caller included; 0 = one a core. */
} bristle_batch_options;

/** Results that a step computes, joined by |: bristle::Outputs. */
enum { BRISTLE_OUTPUT_END = 0, BRISTLE_OUTPUT_MEAN = 1, BRISTLE_OUTPUT_ENERGY = 2 };
/** Precision in which bristles are stored and computed: bristle::Precision. */
enum { BRISTLE_PRECISION_SINGLE = 0, BRISTLE_PRECISION_DOUBLE = 1 };

/** Kind of population that stands for the bristles of a patch: bristle::Population. */
enum {
  BRISTLE_POPULATION_AUTOMATIC = 0, /**< infinite where the law allows it and `bristles` is 0 */
  BRISTLE_POPULATION_REPRESENTATIVES = 1,
  BRISTLE_POPULATION_INFINITE = 2
};

/** Direction of a surface: bristle::Lay. With all ratios 1 there is none. */
typedef struct bristle_lay {
  double angle;           /**< rad, from the patch's x axis to the direction "along" */
  double limit_ratio;     /**< force limit across the direction over that along it */
  double stiffness_ratio; /**< bristle stiffness across over along; 0 = limit_ratio squared */
  double to_over_fro;     /**< force limit for motion along over against it; SnapRule::slide only */
} bristle_lay;

/** Options of a patch: bristle::PatchOptions. */
typedef struct bristle_patch_options {
  size_t struct_size;
  double max_normal_load; /**< N. A larger load scales the forces of all bristles. */
  uint64_t key;           /**< The caller's own 64-bit name of the contact. */
  uint32_t bristles;      /**< Representatives at max load; 0 = one per bristle, at most 4096. */
  uint32_t seed;          /**< Shifts stratified snap lengths, keys random numbers. */
  int32_t axes;           /**< Tangential directions. */
  /** 0 end, 1 mean, 2 energy, 3 all: what is computed beside the force at the end of a step */
  uint32_t outputs;
  uint32_t precision; /**< 0 single, 1 double: of the bristles' state */
  /** 0 automatic, 1 representatives, 2 infinite: automatic: infinite where the law allows it and no number of
   * bristles is named; infinite: a list of cohorts, without noise */
  uint32_t population;
  double resolution; /**< Infinite: pieces of path per mean snap length, 1 to 128; 0 = automatic (8). */
  bristle_lay lay;   /**< Direction of the surface: a Lay. */
} bristle_patch_options;

/** Input of one patch for one step: bristle::Motion. With zeros but for `id`, the patch rests, out of
 * contact. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_motion {
  bristle_id id;
  double displacement[2]; /**< m, displacement of the moving body over the step */
  double normal_load;     /**< N */
  uint8_t has_velocity;   /**< 0: displacement / dt is used; any other value: `velocity` is given */
  uint8_t reserved[7];    /**< not read */
  double velocity[2];     /**< m/s, for the forces in bristle_response::damper only */
} bristle_motion;

/** bristle::Status of a response, joined by |. */
enum {
  BRISTLE_STATUS_OK = 0,
  BRISTLE_STATUS_UNKNOWN_ID = 1,  /**< no such patch; nothing changed */
  BRISTLE_STATUS_REPEATED_ID = 2, /**< named twice in one step: this one changed nothing */
  BRISTLE_STATUS_BAD_INPUT = 4,   /**< NaN, value out of range, dt <= 0: state kept, force zero */
  BRISTLE_STATUS_OVERLOAD = 8,    /**< load above max_normal_load: forces of all bristles scaled */
  BRISTLE_STATUS_NO_CAPACITY = 16 /**< the pool had no patch left for this contact: force zero */
};

/** Output of one patch for one step: bristle::Response. Output fields that the patch does not compute are
 * not written by bristle_step, and set to 0 by bristle_find_force. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_response {
  bristle_id id;
  uint32_t status;     /**< BRISTLE_STATUS_... */
  uint32_t reserved;   /**< without meaning */
  double end[2];       /**< N, force at the end of the step */
  double elastic[2];   /**< N, part of `end` from bent bristles */
  double damper[2];    /**< N, part of `end`, `mean` from dampers, lubricant, strengthening */
  double mean[2];      /**< N, force averaged over the step */
  double stiffness;    /**< N/m */
  double damping;      /**< N s/m, never negative */
  double force_limit;  /**< N, highest elastic force at first loading; if aged, after the longest rest */
  double dissipated;   /**< J, energy lost by snaps, renewals and slides */
  double contact_loss; /**< J, energy that left with bristles that lost contact or weight */
  double damper_work;  /**< J, energy taken by the force `damper` */
  uint64_t snaps;      /**< snaps of representatives or physical bristles; an estimate after a jump */
} bristle_response;

/** The result of a step as a whole: bristle::StepReport. */
typedef struct bristle_step_report {
  size_t struct_size;
  uint32_t status;           /**< flags of all responses together */
  uint32_t patches_stepped;  /**< motions that were executed */
  uint32_t tasks;            /**< pieces of work: 1 = step not shared; 0 = step refused */
  uint32_t threads;          /**< threads that took a piece */
  uint64_t bristles_visited; /**< bristles that a kernel visited */
} bristle_step_report;

/** Present state and memory use of a patch: bristle::PatchInfo. */
typedef struct bristle_patch_info {
  size_t struct_size;
  uint64_t key;
  double weight;            /**< physical bristles per representative; an infinite brush: 0 */
  double active;            /**< representatives in contact, a real number */
  double normal_load;       /**< N, load of the last step */
  uint64_t memory_bytes;    /**< bytes of this patch's state */
  uint32_t representatives; /**< their number; an infinite brush: its resolution, rounded up */
  uint32_t bytes_per_representative;
  const char* kernel;     /**< variant in use, e.g. "2 axes, redraw, end + mean, single" */
  double max_normal_load; /**< N, load from which all representatives are in contact */
} bristle_patch_info;

/** Contacts that were added together: bristle::PatchGroup. Contact i has the id first + i. The struct never
 *  changes. */
typedef struct bristle_group {
  bristle_id first;
  uint32_t count;
} bristle_group;

/** The caller's arrays for a step of a group, one number for each contact: bristle::GroupStep. Null: not
 *  given, or not asked for; `displacement` and `normal_load` are needed. Read and written where it is. */
typedef struct bristle_group_step {
  size_t struct_size;
  bristle_group group;
  const double* displacement[2]; /**< m; the second may be null with one axis */
  const double* normal_load;     /**< N */
  const double* velocity[2];     /**< m/s; null: displacement / dt */
  const uint32_t* which;         /**< indices of the contacts that move; null: all */
  size_t which_count;            /**< number of these indices */
  double* end[2];                /**< N */
  double* elastic[2];            /**< N */
  double* damper[2];             /**< N */
  double* mean[2];               /**< N (BRISTLE_OUTPUT_MEAN) */
  double* stiffness;             /**< N/m */
  double* damping;               /**< N s/m */
  double* force_limit;           /**< N */
  double* dissipated;            /**< J (BRISTLE_OUTPUT_ENERGY) */
  double* contact_loss;          /**< J (BRISTLE_OUTPUT_ENERGY) */
  double* damper_work;           /**< J (BRISTLE_OUTPUT_ENERGY) */
  uint64_t* snaps;               /**< (BRISTLE_OUTPUT_ENERGY) */
  uint32_t* status;              /**< BRISTLE_STATUS_... */
} bristle_group_step;
/** Largest number of groups in one call of bristle_step_groups. */
enum { BRISTLE_MOST_GROUPS = 64 };

/** Sets all arrays of `step` to null. [any] */
BRISTLE_API bristle_result bristle_init_group_step(bristle_group_step* step, size_t struct_size);
/** Fills `options` with the defaults of bristle::BatchOptions. [any] */
BRISTLE_API bristle_result bristle_init_batch_options(bristle_batch_options* options, size_t struct_size);
/** Fills `options` with the defaults of bristle::PatchOptions. [any] */
BRISTLE_API bristle_result bristle_init_patch_options(bristle_patch_options* options, size_t struct_size);
/** Sets `report` to zeros. [any] */
BRISTLE_API bristle_result bristle_init_step_report(bristle_step_report* report, size_t struct_size);
/** Sets `info` to zeros. [any] */
BRISTLE_API bristle_result bristle_init_patch_info(bristle_patch_info* info, size_t struct_size);

/** Makes a batch. `options` may be null: defaults. Destroy it by bristle_destroy. [any] */
BRISTLE_API bristle_result bristle_create(const bristle_batch_options* options, bristle_batch** batch);
/** Destroys the object. Null does nothing. [alone] */
BRISTLE_API void bristle_destroy(bristle_batch* batch);

/** Adds a patch, out of contact, all deflections zero. `options` may be null: defaults. [change] */
BRISTLE_API bristle_result bristle_add(bristle_batch* batch, const bristle_material* material,
                                       const bristle_patch_options* options, bristle_id* id);
/** Adds `count` patches of one material, patch i with options[i]. If one is refused, none is added. [change]
 */
BRISTLE_API bristle_result bristle_add_many(bristle_batch* batch, const bristle_material* material,
                                            const bristle_patch_options* options, size_t options_size,
                                            bristle_id* ids, size_t count);
/** Removes a patch. Refuses an id that names no patch. [change] */
BRISTLE_API bristle_result bristle_remove(bristle_batch* batch, bristle_id id);
/** Changes the material from the next step on: see PatchBatch::set_material. [change] */
BRISTLE_API bristle_result bristle_set_material(bristle_batch* batch, bristle_id id,
                                                const bristle_material* material);

/** Adds `count` contacts to be moved by plain arrays: see PatchBatch::add_group. [change] */
BRISTLE_API bristle_result bristle_add_group(bristle_batch* batch, const bristle_material* material,
                                             const bristle_patch_options* options, size_t count,
                                             bristle_group* group);
/** Removes a group. Refuses one that does not exist. [change] */
BRISTLE_API bristle_result bristle_remove_group(bristle_batch* batch, bristle_group group);
/** Changes the material of a group as bristle_set_material that of a patch. [change] */
BRISTLE_API bristle_result bristle_set_group_material(bristle_batch* batch, bristle_group group,
                                                      const bristle_material* material);

/** Returns a patch to the state in which bristle_add would make it with this seed and key: out of contact,
 * all deflections zero. Refuses an id that names no patch. Never allocates. [step] */
BRISTLE_API bristle_result bristle_reset(bristle_batch* batch, bristle_id id, uint32_t seed, uint64_t key);

/** Takes all waiting changes and makes all allocations. Call before the loop, on the stepping thread.
 * [step] */
BRISTLE_API bristle_result bristle_warm_up(bristle_batch* batch);

/** Moves patches over dt_s (s): responses[i] is the response to motions[i]. A patch that no motion names
 * rests under its last load. `motion_size` and `response_size` are sizeof(bristle_motion) and
 * sizeof(bristle_response). `report` may be null. BRISTLE_OK means that the step was made; each response has
 * the result of its motion.
 *
 *  Never allocates or locks, and waits only for its own workers. [step] */
BRISTLE_API bristle_result bristle_step(bristle_batch* batch, double dt_s, const bristle_motion* motions,
                                        size_t motion_size, bristle_response* responses, size_t response_size,
                                        size_t count, bristle_step_report* report);

/** Moves groups, and patches as bristle_step does, in one step: see PatchBatch::step. Without patches `count`
 *  is 0 and both pointers are null. Refuses more than BRISTLE_MOST_GROUPS groups. `report` may be null; it
 * has the status of a group that could not be stepped. Never allocates or locks. [step] */
BRISTLE_API bristle_result bristle_step_groups(bristle_batch* batch, double dt_s,
                                               const bristle_group_step* groups, size_t group_count,
                                               const bristle_motion* motions, size_t motion_size,
                                               bristle_response* responses, size_t response_size,
                                               size_t count, bristle_step_report* report);
/** Calculates the responses to a group's trial motions, each alone, without changing the state. `report` may
 *  be null. Never allocates. [step] */
BRISTLE_API bristle_result bristle_find_group_force(bristle_batch* batch, double dt_s,
                                                    const bristle_group_step* step,
                                                    bristle_step_report* report);

/** Calculates the responses to trial motions, each alone, without changing the state. For implicit solvers.
 * Never allocates. [step] */
BRISTLE_API bristle_result bristle_find_force(bristle_batch* batch, double dt_s,
                                              const bristle_motion* motions, size_t motion_size,
                                              bristle_response* responses, size_t response_size,
                                              size_t count);

/** Reads state and memory use of a patch; `info` must be initialised. Refuses an id that names no patch.
 * [step] */
BRISTLE_API bristle_result bristle_find_info(const bristle_batch* batch, bristle_id id,
                                             bristle_patch_info* info);
/** Returns the elastic energy of the bristles in contact, J; 0 for an unknown id or a null batch. [step] */
BRISTLE_API double bristle_stored_energy(const bristle_batch* batch, bristle_id id);
/** Returns the hash of the state of one patch, or of all patches if the id is 0; 0 for an unknown id or a
 * null batch. [step] */
BRISTLE_API uint64_t bristle_state_hash(const bristle_batch* batch, bristle_id id);
/** Writes deflections and snap lengths (m) of the first `capacity` bristles; pass null for columns that are
 * not needed. Returns the number written: at most `capacity`, and bristle_patch_info::representatives unless
 * the brush is infinite. [step] */
BRISTLE_API size_t bristle_read_bristles(const bristle_batch* batch, bristle_id id, double* zx, double* zy,
                                         double* delta, size_t capacity);

/** Bytes that bristle_save_state writes now. [step] */
BRISTLE_API size_t bristle_state_size(const bristle_batch* batch);
/** Writes the state of all patches; returns the bytes written, 0 if `size` is too small. [step] */
BRISTLE_API size_t bristle_save_state(const bristle_batch* batch, void* to, size_t size);
/** Restores a saved state into a batch with the same patches, added in the same order. Refuses a state that
 * does not fit, and then changes nothing. [step] */
BRISTLE_API bristle_result bristle_restore_state(bristle_batch* batch, const void* from, size_t size);

/** Patches of the batch; 0 for null. [step] */
BRISTLE_API size_t bristle_patch_count(const bristle_batch* batch);
/** Threads that may step; 0 for null. [any] */
BRISTLE_API int32_t bristle_threads(const bristle_batch* batch);
/** Instruction set in use; null for a null batch. [any] */
BRISTLE_API const char* bristle_isa(const bristle_batch* batch);

/* -------------------------------------------------------------------------------------- patches by key */

/** A pool of patches of one material, or of beds of one kind, found by key: bristle::KeyedPatches, KeyedBeds.
 */
typedef struct bristle_keyed bristle_keyed;
/** Makes lasting keys, by pair of bodies and nearest point: bristle::ContactMatcher. */
typedef struct bristle_matcher bristle_matcher;

/** Key of no contact; its id is BRISTLE_ID_NO_CAPACITY. */
#define BRISTLE_NO_CONTACT_KEY UINT64_MAX
/** Id that bristle_keyed_find_or_add gives a contact without a patch. */
#define BRISTLE_ID_NO_CAPACITY UINT64_MAX

/** Options of a pool of patches or beds: bristle::KeyedOptions. */
typedef struct bristle_keyed_options {
  size_t struct_size;
  uint32_t capacity;   /**< Patches, all made at once. */
  uint32_t keep_steps; /**< Steps that a key may be missing before its patch returns. */
  /** Whether each key has a seed of its own; if not, that of the patch options. */
  uint32_t seed_from_key;
} bristle_keyed_options;

/** Options of a contact matcher: bristle::MatcherOptions. */
typedef struct bristle_matcher_options {
  size_t struct_size;
  double reach;        /**< m. Largest distance at which a contact is found again. */
  uint32_t capacity;   /**< Contacts of one step. */
  uint32_t keep_steps; /**< Steps that a contact may be missing and still be found again. */
} bristle_matcher_options;

/** A contact as an engine lists it: bristle::ContactPoint. Never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_contact_point {
  uint64_t pair;   /**< names the two bodies or geoms, in every step alike */
  double point[3]; /**< m */
} bristle_contact_point;

/** Fills `options` with the defaults of bristle::KeyedOptions. [any] */
BRISTLE_API bristle_result bristle_init_keyed_options(bristle_keyed_options* options, size_t struct_size);
/** Fills `options` with the defaults of bristle::MatcherOptions. [any] */
BRISTLE_API bristle_result bristle_init_matcher_options(bristle_matcher_options* options, size_t struct_size);

/** Adds a pool of patches to the batch. `patch` and `options` may be null: defaults. Destroy it by
 * bristle_keyed_destroy before the batch. [change] */
BRISTLE_API bristle_result bristle_keyed_create(bristle_batch* batch, const bristle_material* material,
                                                const bristle_patch_options* patch,
                                                const bristle_keyed_options* options, bristle_keyed** keyed);
/** Destroys a pool and removes its patches or beds. Null does nothing. [change; for a pool of beds: alone] */
BRISTLE_API void bristle_keyed_destroy(bristle_keyed* keyed);
/** Raises the capacity of a pool to this number of patches or beds, between steps; contacts keep theirs. No
 * other thread may call the pool or its batch meanwhile. [alone] */
BRISTLE_API bristle_result bristle_keyed_reserve(bristle_keyed* keyed, uint32_t capacity);
/** Finds the patches of `count` contacts, fresh ones for new keys; the keys count as seen in this step. Gives
 * BRISTLE_ID_NO_CAPACITY if all patches are in use: a motion with it returns zero force and
 * BRISTLE_STATUS_NO_CAPACITY. Never allocates. [step] */
BRISTLE_API bristle_result bristle_keyed_find_or_add(bristle_keyed* keyed, const uint64_t* keys,
                                                     bristle_id* ids, size_t count);
/** Finds the patches of `count` contacts, id 0 where there is none. The keys do not count as seen. [step] */
BRISTLE_API bristle_result bristle_keyed_find(const bristle_keyed* keyed, const uint64_t* keys,
                                              bristle_id* ids, size_t count);
/** Returns the patch of a contact to the pool. Gives 1 if there was one, else 0. [step] */
BRISTLE_API uint32_t bristle_keyed_remove(bristle_keyed* keyed, uint64_t key);
/** Returns all patches to the pool. Null does nothing. [step] */
BRISTLE_API void bristle_keyed_clear(bristle_keyed* keyed);
/** Returns patches of keys not seen for more than keep_steps to the pool, and their number. Call it once per
 * step, after the last bristle_keyed_find_or_add. [step] */
BRISTLE_API uint32_t bristle_keyed_end_step(bristle_keyed* keyed);
/** Number of current contacts. [step] */
BRISTLE_API uint32_t bristle_keyed_size(const bristle_keyed* keyed);
/** Writes the groups of the pool's patches, as many as fit, and returns their number: one, and one more for
 * each bristle_keyed_reserve; none for outlines and beds. Contact i of a group has the id first + i. [step]
 */
BRISTLE_API size_t bristle_keyed_groups(const bristle_keyed* keyed, bristle_group* groups, size_t count);
/** Number of times that bristle_keyed_find_or_add gave no patch, so far. [step] */
BRISTLE_API uint64_t bristle_keyed_refused(const bristle_keyed* keyed);
/** State of a pool: which contact has which patch (bristle::KeyedPatches). Save it beside the batch's state,
 * and restore it after that. [step] */
BRISTLE_API size_t bristle_keyed_state_size(const bristle_keyed* keyed);
BRISTLE_API size_t bristle_keyed_save_state(const bristle_keyed* keyed, void* to, size_t size);
BRISTLE_API bristle_result bristle_keyed_restore_state(bristle_keyed* keyed, const void* from, size_t size);

/** Makes a matcher. `options` may be null: defaults. Destroy it by bristle_matcher_destroy. [any] */
BRISTLE_API bristle_result bristle_matcher_create(const bristle_matcher_options* options,
                                                  bristle_matcher** matcher);
/** Destroys the object. Null does nothing. [alone] */
BRISTLE_API void bristle_matcher_destroy(bristle_matcher* matcher);
/** Raises the capacity of a matcher to this number of contacts. [alone] */
BRISTLE_API bristle_result bristle_matcher_reserve(bristle_matcher* matcher, uint32_t capacity);
/** Gives keys to all contacts of one step: keys[i] names contacts[i]. `found` (may be null): number of
 * contacts found again. Never allocates. [alone] */
BRISTLE_API bristle_result bristle_matcher_match(bristle_matcher* matcher,
                                                 const bristle_contact_point* contacts, uint64_t* keys,
                                                 size_t count, size_t* found);
/** Forgets all contacts; later ones may get their keys. Null does nothing. [alone] */
BRISTLE_API void bristle_matcher_clear(bristle_matcher* matcher);
/** State of a matcher: the contacts that the next bristle_matcher_match can find again
 * (bristle::ContactMatcher). [alone] */
BRISTLE_API size_t bristle_matcher_state_size(const bristle_matcher* matcher);
BRISTLE_API size_t bristle_matcher_save_state(const bristle_matcher* matcher, void* to, size_t size);
BRISTLE_API bristle_result bristle_matcher_restore_state(bristle_matcher* matcher, const void* from,
                                                         size_t size);

/* ------------------------------------------------------------------------------ patches with an extent */

/** Patches of a batch that have an outline: they resist spin. bristle::ExtendedPatches. */
typedef struct bristle_extended bristle_extended;

/** A cell of an outline: position in m, share of the load. The shares of an outline sum to 1. The struct
 *  never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_cell {
  double position[2];
  double weight;
} bristle_cell;

/** Values of `pressure`: bristle::Pressure. */
enum { BRISTLE_PRESSURE_UNIFORM = 0, BRISTLE_PRESSURE_HERTZ = 1 };

/** Input of one extended patch: bristle::ExtendedMotion. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_extended_motion {
  bristle_id id;
  double displacement[3]; /**< m, m, rad */
  double normal_load;     /**< N */
  uint8_t has_velocity;
  uint8_t reserved[7]; /**< not read */
  double velocity[3];  /**< m/s, m/s, rad/s */
} bristle_extended_motion;

/** Output of one extended patch, in N and N m: bristle::ExtendedResponse. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_extended_response {
  bristle_id id;
  uint32_t status;   /**< BRISTLE_STATUS_... */
  uint32_t reserved; /**< 0 */
  double end[3];
  double elastic[3];
  double damper[3];
  double mean[3];
  double stiffness[3][3];
  double damping[3][3];
  double force_limit;
  double torque_limit;
  double dissipated;
  double contact_loss;
  double damper_work;
  uint64_t snaps; /**< number of snaps in all cells; an estimate where a jump skips a long path */
} bristle_extended_response;

/** Makes the cells of bristle::Outline::ellipse (`around` = 0: automatic), at most `capacity` of them;
 * `count` receives the total number. `cells` may be null with capacity 0. [any] */
BRISTLE_API bristle_result bristle_ellipse_cells(double half_x, double half_y, uint32_t pressure,
                                                 int32_t rings, int32_t around, bristle_cell* cells,
                                                 size_t capacity, size_t* count);
/** Makes the cells of bristle::Outline::rectangle, as bristle_ellipse_cells does. [any] */
BRISTLE_API bristle_result bristle_rectangle_cells(double half_x, double half_y, uint32_t pressure,
                                                   int32_t nx, int32_t ny, bristle_cell* cells,
                                                   size_t capacity, size_t* count);

/** Makes an empty set of extended patches over a batch. Destroy it by bristle_extended_destroy before the
 * batch. [change] */
BRISTLE_API bristle_result bristle_extended_create(bristle_batch* batch, bristle_extended** extended);
/** Destroys a set of extended patches and removes them from the batch. Null does nothing. [change] */
BRISTLE_API void bristle_extended_destroy(bristle_extended* extended);
/** Adds a patch. `options` may be null: defaults. `full_size_load` (N): the load at which the outline has its
 *  given size, which then grows with the cube root of the load; 0 = fixed. Refuses cells whose weights do not
 *  sum to 1. [change] */
BRISTLE_API bristle_result bristle_extended_add(bristle_extended* extended, const bristle_material* material,
                                                const bristle_patch_options* options,
                                                const bristle_cell* cells, size_t count,
                                                double full_size_load, bristle_id* id);
/** Removes an extended patch. Refuses an id that names none. [change] */
BRISTLE_API bristle_result bristle_extended_remove(bristle_extended* extended, bristle_id id);
/** Changes the material of all cells at once, from the next step on. [change] */
BRISTLE_API bristle_result bristle_extended_set_material(bristle_extended* extended, bristle_id id,
                                                         const bristle_material* material);
/** Scales the given size of the outline; 0 to 1e6. Never allocates. [step] */
BRISTLE_API bristle_result bristle_extended_set_scale(bristle_extended* extended, bristle_id id,
                                                      double scale);
/** Steps extended patches, as bristle_step does patches. `report` may be null. Never allocates. [step] */
BRISTLE_API bristle_result bristle_extended_step(bristle_extended* extended, double dt_s,
                                                 const bristle_extended_motion* motions,
                                                 bristle_extended_response* responses, size_t count,
                                                 bristle_step_report* report);
/** Calculates responses to trial motions, without changing the state. [step] */
BRISTLE_API bristle_result bristle_extended_find_force(bristle_extended* extended, double dt_s,
                                                       const bristle_extended_motion* motions,
                                                       bristle_extended_response* responses, size_t count);
/** Hash of the state of one patch, or of all if the id is 0. [step] */
BRISTLE_API uint64_t bristle_extended_state_hash(const bristle_extended* extended, bristle_id id);
/** Save and restore the outlines and the whole batch: as bristle_state_size, bristle_save_state and
 *  bristle_restore_state. [step] */
BRISTLE_API size_t bristle_extended_state_size(const bristle_extended* extended);
BRISTLE_API size_t bristle_extended_save_state(const bristle_extended* extended, void* to, size_t size);
BRISTLE_API bristle_result bristle_extended_restore_state(bristle_extended* extended, const void* from,
                                                          size_t size);

/* ------------------------------------------------------------------------------------------------ beds */

/** Elastic bodies in contact: partial slip, spin, rolling. bristle::BedBatch, whose ids are its own. */
typedef struct bristle_beds bristle_beds;

/** A bristle of a bed given as a list: bristle::BedCell. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_bed_cell {
  double position[2]; /**< m */
  double stiffness;   /**< stiffness relative to the other bristles */
  double load;        /**< share of the load, relative to the other bristles */
} bristle_bed_cell;

/** Values of bristle_bed::kind, pressure and growth: bristle::BedShape::Kind, BedPressure, BedGrowth. */
enum { BRISTLE_BED_ROW = 0, BRISTLE_BED_ELLIPSE = 1, BRISTLE_BED_RECTANGLE = 2, BRISTLE_BED_LIST = 3 };
enum { BRISTLE_BED_UNIFORM = 0, BRISTLE_BED_PARABOLIC = 1, BRISTLE_BED_HERTZ = 2 };
enum { BRISTLE_BED_FIXED = 0, BRISTLE_BED_CUBE_ROOT = 1, BRISTLE_BED_SQUARE_ROOT = 2 };

/** Material, shape and options of a bed: the fields of bristle::BedMaterial, BedShape and BedOptions, which
 *  say units and ranges. bristle_init_bed fills it with defaults. */
typedef struct bristle_bed {
  size_t struct_size;
  double static_friction;
  double kinetic_friction;
  double normal_modulus;        /**< Pa */
  double shear_modulus;         /**< Pa */
  double radius;                /**< m */
  double flexibility[3];        /**< m^3/N */
  double slip_stiffness[2];     /**< N */
  double presliding;            /**< m */
  double half[2];               /**< m */
  const bristle_bed_cell* list; /**< bristles of the kind BRISTLE_BED_LIST */
  size_t list_count;
  double max_normal_load; /**< N */
  double longest_piece;
  int32_t cells[2];
  uint32_t kind; /**< BRISTLE_BED_ROW without `rolls`: bristle::BedShape::sphere_row */
  uint32_t pressure;
  uint32_t growth;
  uint32_t rolls;       /**< 0 or 1 */
  uint32_t all_outputs; /**< 0 or 1 */
  uint32_t reserved;    /**< not read */
} bristle_bed;

/** Input of one bed for one step: bristle::BedMotion. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_bed_motion {
  bristle_id id;
  double displacement[2]; /**< m */
  double spin;            /**< rad */
  double rolled[2];       /**< m */
  double normal_load;     /**< N */
} bristle_bed_motion;

/** Output of one bed for one step: bristle::BedResponse. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_bed_response {
  bristle_id id;
  uint32_t status;   /**< BRISTLE_STATUS_... */
  uint32_t reserved; /**< 0 */
  double force[2];
  double torque;
  double mean[2];
  double mean_torque;
  double dissipated;
  double stored;
  double tangent[3][3];
  double slipping_share;
} bristle_bed_response;

/** Fills `bed` with the defaults of BedMaterial, BedShape and BedOptions. [any] */
BRISTLE_API bristle_result bristle_init_bed(bristle_bed* bed, size_t struct_size);
/** Makes a batch of beds. `options` may be null: defaults. [alone] */
BRISTLE_API bristle_result bristle_beds_create(const bristle_batch_options* options, bristle_beds** beds);
/** Destroys the object. Null does nothing. [alone] */
BRISTLE_API void bristle_beds_destroy(bristle_beds* beds);
/** Adds a bed, out of contact. Refuses what bristle::BedBatch::add refuses. [alone] */
BRISTLE_API bristle_result bristle_beds_add(bristle_beds* beds, const bristle_bed* bed, bristle_id* id);
/** Adds a pool of beds of one kind, found by key. `options` may be null: defaults. The ids that
 * bristle_keyed_... gives are of beds; destroy it by bristle_keyed_destroy before the beds. [alone] */
BRISTLE_API bristle_result bristle_keyed_create_beds(bristle_beds* beds, const bristle_bed* bed,
                                                     const bristle_keyed_options* options,
                                                     bristle_keyed** keyed);
/** Unbends a bed and takes it out of contact. Returns 1 if there is such a bed, else 0. [alone] */
BRISTLE_API uint32_t bristle_beds_reset(bristle_beds* beds, bristle_id id);
/** Removes a bed. Refuses an id that names no bed. [alone] */
BRISTLE_API bristle_result bristle_beds_remove(bristle_beds* beds, bristle_id id);
/** Steps beds: responses[i] answers motions[i]. `report` may be null. Never allocates. [alone] */
BRISTLE_API bristle_result bristle_beds_step(bristle_beds* beds, const bristle_bed_motion* motions,
                                             bristle_bed_response* responses, size_t count,
                                             bristle_step_report* report);
/** Calculates responses to trial motions, without changing the state. Never allocates. [alone] */
BRISTLE_API bristle_result bristle_beds_find_force(bristle_beds* beds, const bristle_bed_motion* motions,
                                                   bristle_bed_response* responses, size_t count);
/** Returns the hash of the state of one bed, or of all if the id is 0. [alone] */
BRISTLE_API uint64_t bristle_beds_state_hash(const bristle_beds* beds, bristle_id id);
/** Bytes that bristle_beds_save_state writes. [alone] */
BRISTLE_API size_t bristle_beds_state_size(const bristle_beds* beds);
/** Writes the state of all beds. Returns the bytes written, 0 if `size` is too small. [alone] */
BRISTLE_API size_t bristle_beds_save_state(const bristle_beds* beds, void* to, size_t size);
/** Restores a saved state into the same beds, added in the same order; else refuses it, state unchanged.
 * [alone] */
BRISTLE_API bristle_result bristle_beds_restore_state(bristle_beds* beds, const void* from, size_t size);

/* ---------------------------------------------------------------------------------------------- joints */

/** Friction of robots' joints, in batches: bristle::JointFriction. */
typedef struct bristle_joints bristle_joints;

/** bristle::JointMaterial, which says units and ranges, in the order of bristle::JointParameter. Index 0: the
 *  motor drives, 1: the joint is driven. The struct never changes. */
typedef struct BRISTLE_SHARED_LAYOUT bristle_joint_material {
  double stiffness; /**< N m/rad */
  double viscous;   /**< N m s/rad */
  double base;      /**< N m */
  double motor[2];
  double outside[2];
  double static_base; /**< N m */
  double static_motor[2];
  double static_outside[2];
  double stribeck_speed; /**< rad/s */
} bristle_joint_material;
/** Numbers of a bristle_joint_material: rows of bristle_joint_step::gradient. */
enum { BRISTLE_JOINT_PARAMETERS = 13 };

/** Options of a batch of joints: bristle::JointOptions. */
typedef struct bristle_joint_options {
  size_t struct_size;
  double spread;      /**< Coefficient of variation of the bristles' limits. */
  int32_t bristles;   /**< Bristles of each joint. */
  uint32_t gradients; /**< Whether gradients may be asked for. */
} bristle_joint_options;

/** The caller's arrays of a step, one number for each joint: bristle::JointInput and JointOutput. Null: not
 * given, or not asked for; only `angle` is needed. Read and written where it is. */
typedef struct bristle_joint_step {
  size_t struct_size;
  const double* angle;   /**< rad */
  const double* speed;   /**< rad/s */
  const double* motor;   /**< N m */
  const double* outside; /**< N m */
  double* torque;        /**< N m, on the joint, at the end */
  double* mean;          /**< N m */
  double* by_angle;      /**< N m/rad */
  double* by_speed;      /**< N m s/rad */
  double* by_motor;
  double* by_outside;
  double* gradient; /**< BRISTLE_JOINT_PARAMETERS rows of one number for each joint */
  uint32_t* status; /**< BRISTLE_STATUS_... */
} bristle_joint_step;

/** Fills `options` with the defaults of bristle::JointOptions. [any] */
BRISTLE_API bristle_result bristle_init_joint_options(bristle_joint_options* options, size_t struct_size);
/** Sets all arrays of `step` to null. [any] */
BRISTLE_API bristle_result bristle_init_joint_step(bristle_joint_step* step, size_t struct_size);
/** Makes `count` joints; joint i is of materials[i % material_count]. Both options may be null: defaults.
 * [alone] */
BRISTLE_API bristle_result bristle_joints_create(size_t count, const bristle_joint_material* materials,
                                                 size_t material_count, const bristle_joint_options* options,
                                                 const bristle_batch_options* batch, bristle_joints** joints);
/** Destroys the object. Null does nothing. [alone] */
BRISTLE_API void bristle_joints_destroy(bristle_joints* joints);
/** Moves all joints. Arrays are as long as there are joints. `report` may be null. BRISTLE_REFUSED, state
 *  unchanged, for a gradient that the options do not allow. Never allocates. [alone] */
BRISTLE_API bristle_result bristle_joints_step(bristle_joints* joints, const bristle_joint_step* step,
                                               bristle_step_report* report);
/** Calculates torques as bristle_joints_step, without changing the state. [alone] */
BRISTLE_API bristle_result bristle_joints_find_torque(bristle_joints* joints, const bristle_joint_step* step,
                                                      bristle_step_report* report);
/** Unbends the bristles of all joints. [alone] */
BRISTLE_API bristle_result bristle_joints_reset(bristle_joints* joints);
/** Unbends the bristles of one joint. [alone] */
BRISTLE_API bristle_result bristle_joints_reset_one(bristle_joints* joints, size_t joint);
/** Returns the hash of the state of all joints. [alone] */
BRISTLE_API uint64_t bristle_joints_state_hash(const bristle_joints* joints);
/** Bytes that bristle_joints_save_state writes. [alone] */
BRISTLE_API size_t bristle_joints_state_size(const bristle_joints* joints);
/** Writes the state of all joints. Returns the bytes written, 0 if `size` is too small. [alone] */
BRISTLE_API size_t bristle_joints_save_state(const bristle_joints* joints, void* to, size_t size);
/** Restores a saved state into the same joints with the same options; else refuses it, state unchanged.
 * [alone] */
BRISTLE_API bristle_result bristle_joints_restore_state(bristle_joints* joints, const void* from,
                                                        size_t size);

/* ------------------------------------------------------------------------------------ deadline monitor */

/** Step times and periods of a loop against its deadline, in constant memory: bristle::DeadlineMonitor. */
typedef struct bristle_monitor bristle_monitor;

/** The numbers of a monitor. Times in s; percentiles at most 1.6 % high, maxima exact. */
typedef struct bristle_monitor_report {
  size_t struct_size;
  double deadline;
  double period; /**< 0: ticks have no period */
  double p50;
  double p99;
  double p999;
  double max;
  double mean;
  double jitter_p50; /**< percentiles of |time from start to start - period| */
  double jitter_p99;
  double jitter_max;
  uint64_t count;
  uint64_t misses;      /**< ticks that missed the deadline */
  uint64_t misses_ours; /**< caused by this program: CPU time over the deadline or not measured; the machine
                             caused the others */
  uint64_t skipped;     /**< ticks of the grid that were skipped */
  uint64_t longest_run; /**< most ticks in a row that were late or skipped */
  uint64_t involuntary_switches; /**< preemptions in late ticks, as the system counts them */
  uint64_t minor_faults;
  uint64_t major_faults;
} bristle_monitor_report;

/** Sets `report` to zeros. [any] */
BRISTLE_API bristle_result bristle_init_monitor_report(bristle_monitor_report* report, size_t struct_size);
/** Makes a monitor of a deadline and a nominal period (0: none). Destroy it by bristle_monitor_destroy.
 * [any] */
BRISTLE_API bristle_result bristle_monitor_create(double deadline_s, double period_s,
                                                  bristle_monitor** monitor);
/** Destroys the object. Null does nothing. [alone] */
BRISTLE_API void bristle_monitor_destroy(bristle_monitor* monitor);
/** Records one step that was due when it started: wall time and CPU time of the stepping thread; cpu_s < 0
 *  means not measured. Null does nothing. Never allocates. [step] */
BRISTLE_API void bristle_monitor_record(bristle_monitor* monitor, double wall_s, double cpu_s);
/** Records one tick of a loop with a period: when it was due, started and ended (times of bristle_wall_now),
 *  and its CPU time. Null does nothing. Never allocates. [step] */
BRISTLE_API void bristle_monitor_record_tick(bristle_monitor* monitor, double due_s, double start_s,
                                             double end_s, double cpu_s);
/** Records ticks of the grid that were skipped. Null does nothing. [step] */
BRISTLE_API void bristle_monitor_record_skipped(bristle_monitor* monitor, uint64_t ticks);
/** Tells that the loop paused: the next tick starts a new grid. Null does nothing. [step] */
BRISTLE_API void bristle_monitor_pause(bristle_monitor* monitor);
/** Reads the event counters, so that events of a late tick count from this call on. Takes a microsecond; call
 * it between ticks. Null does nothing. [step] */
BRISTLE_API void bristle_monitor_refresh_events(bristle_monitor* monitor);
/** Sets all numbers to zero. Null does nothing. [step] */
BRISTLE_API void bristle_monitor_reset(bristle_monitor* monitor);
/** Reads all numbers of one moment; `report` must be initialised. BRISTLE_REFUSED if the loop leaves no gap
 * between two ticks. [any] */
BRISTLE_API bristle_result bristle_monitor_find_report(const bristle_monitor* monitor,
                                                       bristle_monitor_report* report);
/** Monotonic wall clock, s. [any] */
BRISTLE_API double bristle_wall_now(void);
/** CPU time of the calling thread, s. [any] */
BRISTLE_API double bristle_cpu_now(void);

#ifdef __cplusplus
}
#endif
