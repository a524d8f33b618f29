/* The C interface as a C99 program uses it. Each function returns 0, or the line that went
 * wrong. */
#include "c_program.h"

#include <bristle/bristle.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define EXPECT(what)              \
  do {                            \
    if (!(what)) return __LINE__; \
  } while (0)

/* One bristle per newton of load and a stiffness of 1 N/m, as plain_material of the C++ tests. */
static bristle_material plain_material(double dbar) {
  bristle_material m;
  bristle_init_material(&m, sizeof m);
  m.bristle_stiffness = 1.0;
  m.normal_stiffness = 1e6;
  m.asperity_height_deviation = 1e-6;
  m.snap_length.law = BRISTLE_LAW_UNIFORM;
  m.snap_length.first_parameter = 0.5 * dbar;
  m.snap_length.second_parameter = 1.5 * dbar;
  m.snap_rule = BRISTLE_RULE_KEEP;
  return m;
}

static bristle_patch_options plain_options(uint32_t bristles) {
  bristle_patch_options o;
  bristle_init_patch_options(&o, sizeof o);
  o.max_normal_load = bristles;
  o.bristles = bristles;
  o.axes = 1;
  return o;
}

int c_program_reads_and_restores(void) {
  enum { n = 500 };
  static double zx[n], delta[n];
  static unsigned char saved[1 << 16];
  bristle_batch* batch = NULL;
  bristle_id id = 0;
  bristle_material material = plain_material(10e-6);
  bristle_patch_options options = plain_options(n);
  bristle_motion motion = {0};
  bristle_response response;
  uint64_t hash;
  size_t bytes;
  double energy = 0.0;
  int i;
  EXPECT(bristle_check_build(BRISTLE_VERSION_NUMBER, BRISTLE_BUILD_OPTIONS) == BRISTLE_OK);
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  EXPECT(bristle_add(batch, &material, &options, &id) == BRISTLE_OK);
  EXPECT(bristle_warm_up(batch) == BRISTLE_OK);
  motion.id = id;
  motion.displacement[0] = 9e-6;
  motion.normal_load = n;
  EXPECT(bristle_step(batch, 1e-3, &motion, sizeof motion, &response, sizeof response, 1, NULL) ==
         BRISTLE_OK);
  EXPECT(response.id == id && response.stiffness == (double)n);
  EXPECT(bristle_read_bristles(batch, id, zx, NULL, delta, n) == n);
  for (i = 0; i < n; ++i) {
    /* After a slide of 9 um a bristle is bent by 9 um, or by the rest of the path if it has snapped. */
    const double bent = delta[i] > 9e-6 ? 9e-6 : 9e-6 - delta[i];
    EXPECT(delta[i] >= 5e-6 * (1 - 1e-6) && delta[i] <= 15e-6 * (1 + 1e-6));
    EXPECT(fabs(zx[i] - bent) < 1e-11);
    energy += 0.5 * zx[i] * zx[i];
  }
  EXPECT(fabs(bristle_stored_energy(batch, id) - energy) < 1e-9 * energy);
  EXPECT(bristle_read_bristles(batch, id, zx, NULL, delta, 0) == 0);
  EXPECT(bristle_read_bristles(batch, id, NULL, NULL, NULL, 3) == 3);
  hash = bristle_state_hash(batch, id);
  bytes = bristle_state_size(batch);
  EXPECT(bytes <= sizeof saved && bristle_save_state(batch, saved, sizeof saved) == bytes);
  saved[bytes / 2] ^= 1;
  EXPECT(bristle_restore_state(batch, saved, bytes) == BRISTLE_REFUSED);
  EXPECT(strstr(bristle_last_error(), "damaged") != NULL);
  EXPECT(bristle_state_hash(batch, id) == hash);
  EXPECT(bristle_reset(batch, id, 1, 77) == BRISTLE_OK);
  EXPECT(bristle_stored_energy(batch, id) == 0.0);
  EXPECT(bristle_remove(batch, id) == BRISTLE_OK);
  EXPECT(bristle_remove(batch, id) == BRISTLE_REFUSED);
  bristle_destroy(batch);
  return 0;
}

int c_program_hears_why(void) {
  bristle_batch* batch = NULL;
  bristle_id id = 5;
  bristle_material material = plain_material(10e-6);
  bristle_coefficients coefficients;
  bristle_batch_options options;
  bristle_motion motion = {0};
  bristle_response response = {0};
  EXPECT(bristle_create(NULL, NULL) == BRISTLE_BAD_ARGUMENT);
  EXPECT(strcmp(bristle_last_error(), "batch is null") == 0);
  EXPECT(bristle_init_batch_options(&options, sizeof options) == BRISTLE_OK);
  options.isa = "abacus";
  EXPECT(bristle_create(&options, &batch) == BRISTLE_REFUSED);
  EXPECT(batch == NULL && strstr(bristle_last_error(), "isa = abacus") != NULL);
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  material.normal_stiffness = -1.0;
  EXPECT(bristle_add(batch, &material, NULL, &id) == BRISTLE_REFUSED);
  EXPECT(id == 5 && strstr(bristle_last_error(), "normal_stiffness = -1") != NULL);
  EXPECT(bristle_material_check(&material) == BRISTLE_REFUSED);
  material = plain_material(10e-6);
  material.snap_rule = 256; /* a value that reads as 0 if cut to a byte */
  EXPECT(bristle_material_check(&material) == BRISTLE_REFUSED);
  EXPECT(strcmp(bristle_last_error(), "bristle_material: snap_rule = 256; allowed is 0 to 2") == 0);
  material = plain_material(10e-6);
  material.snap_length.law = BRISTLE_LAW_TABLE;
  EXPECT(bristle_material_check(&material) == BRISTLE_BAD_ARGUMENT);
  memset(&material, 0, sizeof material);
  EXPECT(bristle_material_check(&material) == BRISTLE_BAD_ARGUMENT);
  EXPECT(strstr(bristle_last_error(), "bristle_init_") != NULL);
  EXPECT(bristle_init_coefficients(&coefficients, sizeof coefficients) == BRISTLE_OK);
  coefficients.peak = 5.0 * coefficients.kinetic;
  bristle_init_material(&material, sizeof material);
  EXPECT(bristle_material_from_coefficients(&coefficients, &material) == BRISTLE_REFUSED);
  EXPECT(bristle_step(NULL, 1e-3, NULL, 0, NULL, 0, 0, NULL) == BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_step(batch, 1e-3, NULL, sizeof motion, &response, sizeof response, 1, NULL) ==
         BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_step(batch, 1e-3, &motion, 8, &response, sizeof response, 1, NULL) == BRISTLE_BAD_ARGUMENT);
  motion.id = 123;
  EXPECT(bristle_step(batch, 1e-3, &motion, sizeof motion, &response, sizeof response, 1, NULL) ==
         BRISTLE_OK);
  EXPECT(response.id == 123 && response.status == BRISTLE_STATUS_UNKNOWN_ID);
  bristle_destroy(batch);
  bristle_destroy(NULL);
  EXPECT(bristle_check_build(BRISTLE_VERSION_NUMBER + 100, BRISTLE_BUILD_OPTIONS) == BRISTLE_WRONG_BUILD);
  EXPECT(strcmp(bristle_result_name(BRISTLE_WRONG_BUILD), "BRISTLE_WRONG_BUILD") == 0);
  return 0;
}

int c_program_finds_all_as_it_was(void) {
  enum { n = 100 };
  bristle_batch* batch = NULL;
  bristle_id id = 0, ids[2] = {5, 6};
  bristle_material material = plain_material(10e-6);
  bristle_patch_options options[2];
  bristle_step_report report;
  bristle_motion motion = {0};
  bristle_response response = {0};
  const double shares[2] = {0.5, 1.0}, far[2] = {0.5, 2e6};
  double out[2] = {-7.5, -7.5}, moment = -7.5;
  uint64_t hash;
  options[0] = options[1] = plain_options(n);
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  EXPECT(bristle_add(batch, &material, options, &id) == BRISTLE_OK);
  EXPECT(bristle_warm_up(batch) == BRISTLE_OK);
  motion.id = id;
  motion.displacement[0] = 1e-6;
  motion.normal_load = n;
  hash = bristle_state_hash(batch, id);
  memset(&report, 0, sizeof report); /* leaves `report` without the size that its init function sets */
  EXPECT(bristle_step(batch, 1e-3, &motion, sizeof motion, &response, sizeof response, 1, &report) ==
         BRISTLE_BAD_ARGUMENT);
  EXPECT(strstr(bristle_last_error(), "report") == bristle_last_error());
  EXPECT(bristle_state_hash(batch, id) == hash && response.id == 0);
  options[1].axes = 3;
  EXPECT(bristle_add_many(batch, &material, options, sizeof options[0], ids, 2) == BRISTLE_REFUSED);
  EXPECT(ids[0] == 5 && ids[1] == 6);
  EXPECT(bristle_warm_up(batch) == BRISTLE_OK && bristle_patch_count(batch) == 1);
  EXPECT(bristle_snap_length_quantile(&material.snap_length, shares, out, 2) == BRISTLE_REFUSED);
  EXPECT(bristle_material_virgin_deflection(&material, far, out, 2) == BRISTLE_REFUSED);
  EXPECT(bristle_snap_length_moment(&material.snap_length, 3, &moment, shares, out, 2) == BRISTLE_REFUSED);
  EXPECT(out[0] == -7.5 && out[1] == -7.5 && moment == -7.5);
  bristle_destroy(batch);
  return 0;
}

int c_program_goes_to_coefficients_and_back(void) {
  bristle_coefficients there, back;
  bristle_material material;
  bristle_material_facts facts;
  const double speeds[2] = {0.0, 2e-3};
  const double shares[3] = {0.25, 0.5, 0.75};
  const double table[3] = {2e-6, 6e-6, 8e-6};
  double forces[2], lengths[3], moment;
  bristle_snap_length law;
  bristle_init_coefficients(&there, sizeof there);
  bristle_init_coefficients(&back, sizeof back);
  bristle_init_material(&material, sizeof material);
  bristle_init_material_facts(&facts, sizeof facts);
  there.kinetic = 0.3;
  there.peak = 0.36;
  there.viscous_friction = 5.0;
  there.damper_decay = BRISTLE_DECAY_GAUSSIAN;
  EXPECT(bristle_material_from_coefficients(&there, &material) == BRISTLE_OK);
  EXPECT(bristle_material_to_coefficients(&material, &back) == BRISTLE_OK);
  EXPECT(fabs(back.kinetic - 0.3) < 1e-9 && fabs(back.peak - 0.36) < 1e-6);
  EXPECT(back.viscous_friction == 5.0 && back.law == BRISTLE_LAW_LOGNORMAL);
  EXPECT(back.damper_decay == BRISTLE_DECAY_GAUSSIAN && back.rule == BRISTLE_RULE_REDRAW);
  EXPECT(bristle_material_find_facts(&material, &facts) == BRISTLE_OK);
  EXPECT(fabs(facts.kinetic_coefficient - 0.3) < 1e-9 && fabs(facts.mean_snap_length - 9e-6) < 1e-15);
  EXPECT(fabs(facts.bristles_per_newton - 900.0) < 1e-9);
  EXPECT(bristle_material_steady_force(&material, 2.0, speeds, forces, 2) == BRISTLE_OK);
  EXPECT(fabs(forces[0] - 0.6) < 1e-9 && fabs(forces[1] - (0.6 + 2e-3 * 5.0)) < 1e-9);
  /* With ageing, the coefficients hold at a sliding speed of 2 mm/s and are read back at that speed. */
  there.kinetic_speed = 2e-3;
  there.growth_per_decade = 0.06;
  there.ageing_time = 1e-4;
  there.speed_strengthening = 0.01;
  EXPECT(bristle_material_from_coefficients(&there, &material) == BRISTLE_OK);
  EXPECT(material.ageing_form == BRISTLE_AGEING_LOGARITHMIC && material.ageing_strength > 0.0);
  EXPECT(material.ageing_time == 1e-4 && material.speed_strengthening == 0.01);
  EXPECT(bristle_material_kinetic_at(&material, speeds, forces, 2) == BRISTLE_OK);
  EXPECT(forces[0] > forces[1] && fabs(forces[1] - 0.3) < 1e-9);
  back.kinetic_speed = 2e-3;
  EXPECT(bristle_material_to_coefficients(&material, &back) == BRISTLE_OK);
  EXPECT(fabs(back.kinetic - 0.3) < 1e-9 && fabs(back.peak - 0.36) < 1e-6);
  EXPECT(back.fall_per_decade > 0.02 && back.fall_per_decade < 0.03 && back.growth_per_decade == 0.0);
  there.fall_per_decade = 0.05;
  EXPECT(bristle_material_from_coefficients(&there, &material) == BRISTLE_REFUSED);
  EXPECT(bristle_typical_coefficients("fingertip on glass", &there) == BRISTLE_OK);
  EXPECT(there.kinetic == 0.8 && there.peak == 0.9 && there.presliding_length == 0.8e-3);
  EXPECT(bristle_typical_coefficients("oak", &there) == BRISTLE_REFUSED && there.kinetic == 0.8);
  EXPECT(strstr(bristle_last_error(), "fingertip on glass") != NULL);
  EXPECT(strcmp(bristle_typical_name(0), "steel on steel, dry") == 0 && bristle_typical_name(1000) == NULL);
  memset(&law, 0, sizeof law);
  law.law = BRISTLE_LAW_TABLE;
  law.table = table;
  law.table_size = 3;
  EXPECT(bristle_snap_length_quantile(&law, shares, lengths, 3) == BRISTLE_OK);
  EXPECT(fabs(lengths[0] - 4e-6) < 1e-15 && fabs(lengths[1] - 6e-6) < 1e-15);
  EXPECT(fabs(lengths[2] - 7e-6) < 1e-15);
  EXPECT(bristle_snap_length_moment(&law, 1, &moment, NULL, NULL, 0) == BRISTLE_OK);
  EXPECT(fabs(moment - 5.5e-6) < 1e-15); /* mean of a uniform law from 4 to 7 um */
  EXPECT(bristle_snap_length_survival(&law, table + 1, lengths, 1) == BRISTLE_OK);
  EXPECT(fabs(lengths[0] - 0.5) < 1e-12);
  return 0;
}

int c_program_names_contacts(void) {
  bristle_batch* batch = NULL;
  bristle_keyed* keyed = NULL;
  bristle_matcher* matcher = NULL;
  bristle_keyed_options options;
  bristle_matcher_options matched;
  bristle_material material = plain_material(10e-6);
  bristle_patch_options patch = plain_options(10);
  bristle_contact_point points[2] = {{7, {0, 0, 0}}, {7, {1e-2, 0, 0}}};
  bristle_contact_point swapped[2];
  uint64_t keys[2], next[2];
  bristle_id ids[2], again[2];
  size_t found = 9;
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  EXPECT(bristle_init_keyed_options(&options, sizeof options) == BRISTLE_OK);
  options.capacity = 2;
  EXPECT(bristle_keyed_create(batch, &material, &patch, &options, &keyed) == BRISTLE_OK);
  EXPECT(bristle_init_matcher_options(&matched, sizeof matched) == BRISTLE_OK);
  EXPECT(bristle_matcher_create(&matched, &matcher) == BRISTLE_OK);
  EXPECT(bristle_warm_up(batch) == BRISTLE_OK);
  EXPECT(bristle_patch_count(batch) == 2);
  EXPECT(bristle_matcher_match(matcher, points, keys, 2, &found) == BRISTLE_OK);
  EXPECT(found == 0 && keys[0] != keys[1]);
  EXPECT(bristle_keyed_find_or_add(keyed, keys, ids, 2) == BRISTLE_OK);
  EXPECT(ids[0] != 0 && ids[1] != 0 && ids[0] != ids[1]);
  EXPECT(bristle_keyed_end_step(keyed) == 0 && bristle_keyed_size(keyed) == 2);
  swapped[0] = points[1]; /* the engine lists the points in the other order, 0.1 mm further on */
  swapped[1] = points[0];
  swapped[0].point[1] = swapped[1].point[1] = 1e-4;
  EXPECT(bristle_matcher_match(matcher, swapped, next, 2, &found) == BRISTLE_OK);
  EXPECT(found == 2 && next[0] == keys[1] && next[1] == keys[0]);
  EXPECT(bristle_keyed_find_or_add(keyed, next, again, 1) == BRISTLE_OK);
  EXPECT(again[0] == ids[1]);
  EXPECT(bristle_keyed_end_step(keyed) == 1); /* forgets the patch whose key was not seen in this step */
  EXPECT(bristle_keyed_find(keyed, keys, again, 2) == BRISTLE_OK);
  EXPECT(again[0] == 0 && again[1] == ids[1]);
  EXPECT(bristle_keyed_remove(keyed, keys[1]) == 1 && bristle_keyed_remove(keyed, keys[1]) == 0);
  EXPECT(bristle_keyed_refused(keyed) == 0);
  {
    /* A third contact gets no patch from a pool of two, and is counted as refused. */
    const uint64_t third[3] = {keys[1], 77, 78};
    bristle_id many[3];
    EXPECT(bristle_keyed_find_or_add(keyed, third, many, 3) == BRISTLE_OK);
    EXPECT(many[1] != BRISTLE_ID_NO_CAPACITY && many[2] == BRISTLE_ID_NO_CAPACITY);
    EXPECT(bristle_keyed_refused(keyed) == 1);
    EXPECT(bristle_keyed_reserve(keyed, 3) == BRISTLE_OK && bristle_patch_count(batch) == 3);
    EXPECT(bristle_keyed_find_or_add(keyed, third, many, 3) == BRISTLE_OK);
    EXPECT(many[2] != BRISTLE_ID_NO_CAPACITY && bristle_keyed_remove(keyed, 78) == 1);
    EXPECT(bristle_matcher_reserve(matcher, 2000) == BRISTLE_OK);
    EXPECT(bristle_matcher_reserve(matcher, 1u << 25) == BRISTLE_REFUSED);
    EXPECT(bristle_keyed_remove(keyed, 77) == 1 && bristle_keyed_remove(keyed, keys[1]) == 1);
  }
  {
    unsigned char state[256];
    const size_t of_keys = bristle_keyed_state_size(keyed), of_points = bristle_matcher_state_size(matcher);
    EXPECT(bristle_keyed_save_state(keyed, state, of_keys - 1) == 0);
    EXPECT(bristle_keyed_save_state(keyed, state, sizeof state) == of_keys);
    EXPECT(bristle_keyed_restore_state(keyed, state, of_keys) == BRISTLE_OK);
    EXPECT(bristle_matcher_restore_state(matcher, state, of_keys) == BRISTLE_REFUSED);
    EXPECT(bristle_matcher_save_state(matcher, state, sizeof state) == of_points);
    EXPECT(bristle_matcher_restore_state(matcher, state, of_points) == BRISTLE_OK);
    EXPECT(bristle_matcher_match(matcher, points, next, 2, &found) == BRISTLE_OK);
    EXPECT(found == 2 && next[0] == keys[0] && next[1] == keys[1]);
  }
  bristle_matcher_clear(matcher);
  EXPECT(bristle_matcher_match(matcher, points, next, 2, &found) == BRISTLE_OK && found == 0);
  EXPECT(bristle_keyed_find_or_add(keyed, next, ids, 2) == BRISTLE_OK && bristle_keyed_size(keyed) == 2);
  bristle_keyed_clear(keyed);
  EXPECT(bristle_keyed_size(keyed) == 0);
  bristle_keyed_clear(NULL);
  bristle_matcher_clear(NULL);
  bristle_matcher_destroy(matcher);
  bristle_keyed_destroy(keyed);
  EXPECT(bristle_patch_count(batch) == 0);
  bristle_destroy(batch);
  return 0;
}

int c_program_moves_a_group(void) {
  enum { n = 20 };
  bristle_batch* batch = NULL;
  bristle_material material = plain_material(10e-6);
  bristle_patch_options options = plain_options(8);
  bristle_group group;
  bristle_group_step step;
  bristle_step_report report;
  bristle_id id = 0;
  bristle_motion motion = {0};
  bristle_response response;
  double displacement[n], load[n], end[n];
  uint32_t one[] = {3}, beyond[] = {n};
  int i;
  material.snap_rule = BRISTLE_RULE_SLIDE;
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  EXPECT(bristle_add_group(batch, &material, &options, 0, &group) == BRISTLE_REFUSED);
  EXPECT(bristle_add_group(batch, &material, &options, n, NULL) == BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_add_group(batch, &material, &options, n, &group) == BRISTLE_OK);
  EXPECT(group.count == n);
  EXPECT(bristle_add(batch, &material, &options, &id) == BRISTLE_OK);
  EXPECT(bristle_init_group_step(&step, sizeof step - 1) == BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_init_group_step(&step, sizeof step) == BRISTLE_OK);
  EXPECT(bristle_init_step_report(&report, sizeof report) == BRISTLE_OK);
  for (i = 0; i < n; ++i) {
    displacement[i] = 4e-6;
    load[i] = 0.5 * i;
  }
  step.group = group;
  step.displacement[0] = displacement;
  step.normal_load = load;
  step.end[0] = end;
  motion.id = id;
  motion.displacement[0] = 4e-6;
  motion.normal_load = 3.5;
  EXPECT(bristle_step_groups(batch, 1e-3, &step, 1, &motion, sizeof motion, &response, sizeof response, 1,
                             &report) == BRISTLE_OK);
  EXPECT(report.patches_stepped == n + 1 && end[7] == response.end[0] && end[7] < 0.0);
  step.which = one;
  step.which_count = 1;
  EXPECT(bristle_step_groups(batch, 1e-3, &step, 1, NULL, sizeof motion, NULL, sizeof response, 0, &report) ==
         BRISTLE_OK);
  EXPECT(report.patches_stepped == 1);
  step.which = beyond;
  EXPECT(bristle_step_groups(batch, 1e-3, &step, 1, NULL, sizeof motion, NULL, sizeof response, 0, &report) ==
         BRISTLE_OK);
  EXPECT(report.status == BRISTLE_STATUS_BAD_INPUT && report.patches_stepped == 0);
  EXPECT(bristle_step_groups(batch, 1e-3, &step, BRISTLE_MOST_GROUPS + 1, NULL, sizeof motion, NULL,
                             sizeof response, 0, NULL) == BRISTLE_REFUSED);
  EXPECT(bristle_step_groups(batch, 1e-3, NULL, 1, NULL, sizeof motion, NULL, sizeof response, 0, NULL) ==
         BRISTLE_BAD_ARGUMENT);
  step.struct_size = 1;
  EXPECT(bristle_find_group_force(batch, 1e-3, &step, NULL) == BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_set_material(batch, group.first, &material) == BRISTLE_REFUSED);
  EXPECT(bristle_remove_group(batch, group) == BRISTLE_OK);
  EXPECT(bristle_remove_group(batch, group) == BRISTLE_REFUSED);
  bristle_destroy(batch);
  return 0;
}

int c_program_twists_a_pad(void) {
  enum { most = 64 };
  bristle_batch* batch = NULL;
  bristle_extended* pads = NULL;
  bristle_cell cells[most];
  bristle_id id = 0;
  size_t count = 0;
  const double radius = 4e-3, spin = 1e-6;
  bristle_material material = plain_material(10e-6);
  bristle_patch_options options = plain_options(1000);
  bristle_extended_motion motion = {0};
  bristle_extended_response response;
  bristle_step_report report;
  EXPECT(bristle_create(NULL, &batch) == BRISTLE_OK);
  EXPECT(bristle_extended_create(batch, &pads) == BRISTLE_OK);
  EXPECT(bristle_ellipse_cells(radius, radius, BRISTLE_PRESSURE_HERTZ, 3, 0, NULL, 0, &count) == BRISTLE_OK);
  EXPECT(count == 27);
  EXPECT(bristle_rectangle_cells(radius, radius, BRISTLE_PRESSURE_UNIFORM, 2, 2, cells, most, &count) ==
         BRISTLE_OK);
  EXPECT(count == 4 && fabs(fabs(cells[0].position[0]) - radius / sqrt(3.0)) < 1e-15);
  EXPECT(fabs(cells[0].weight - 0.25) < 1e-15);
  EXPECT(bristle_ellipse_cells(radius, radius, 2, 3, 0, cells, most, &count) == BRISTLE_REFUSED);
  EXPECT(bristle_ellipse_cells(radius, radius, BRISTLE_PRESSURE_HERTZ, 3, 0, cells, most, &count) ==
         BRISTLE_OK);
  options.axes = 2;
  EXPECT(bristle_extended_add(pads, &material, &options, cells, count - 1, 0.0, &id) == BRISTLE_REFUSED);
  EXPECT(strstr(bristle_last_error(), "sum of weights") != NULL);
  EXPECT(bristle_extended_add(pads, &material, &options, cells, count, 0.0, &id) == BRISTLE_OK);
  EXPECT(bristle_warm_up(batch) == BRISTLE_OK && bristle_patch_count(batch) == 27);
  EXPECT(bristle_init_step_report(&report, sizeof report) == BRISTLE_OK);
  motion.id = id;
  motion.normal_load = options.max_normal_load;
  motion.displacement[2] = spin;
  EXPECT(bristle_extended_step(pads, 1e-3, &motion, &response, 1, &report) == BRISTLE_OK);
  EXPECT(report.patches_stepped == 1 && response.status == BRISTLE_STATUS_OK);
  /* Turning a disc that sticks under Hertz's pressure: torque 2 K R^2 / 5 per rad, with stiffness K and
     radius R. */
  EXPECT(fabs(-response.elastic[2] / (0.4 * response.stiffness[0][0] * radius * radius * spin) - 1) < 1e-6);
  EXPECT(response.stiffness[0][0] > 0);
  EXPECT(bristle_extended_restore_state(pads, cells, sizeof cells) == BRISTLE_REFUSED);
  EXPECT(bristle_extended_set_scale(pads, id, 2.0) == BRISTLE_OK);
  EXPECT(bristle_extended_set_scale(pads, id, -1.0) == BRISTLE_REFUSED);
  EXPECT(bristle_extended_set_scale(pads, 77, 1.0) == BRISTLE_REFUSED);
  EXPECT(strstr(bristle_last_error(), "no patch with id 77") != NULL);
  EXPECT(bristle_extended_step(NULL, 1e-3, &motion, &response, 1, NULL) == BRISTLE_BAD_ARGUMENT);
  EXPECT(bristle_extended_remove(pads, id) == BRISTLE_OK);
  EXPECT(bristle_extended_remove(pads, id) == BRISTLE_REFUSED);
  bristle_extended_destroy(pads);
  bristle_destroy(batch);
  return 0;
}

int c_program_asks_what_it_runs_on(void) {
  bristle_batch* batch = NULL;
  bristle_batch_options options;
  bristle_material material = plain_material(10e-6);
  const double speeds[2] = {0.0, 1e-3};
  double dampings[2];
  uint32_t usable = 9;
  const size_t sets = bristle_instruction_set_count();
  const char* last = bristle_instruction_set(sets - 1, &usable);
  EXPECT(last != NULL && strcmp(last, "scalar") == 0 && usable == 1);
  EXPECT(bristle_instruction_set(sets, &usable) == NULL);
  EXPECT(bristle_init_batch_options(&options, sizeof options) == BRISTLE_OK);
  options.threads = 2;
  options.isa = last;
  EXPECT(bristle_create(&options, &batch) == BRISTLE_OK);
  EXPECT(strcmp(bristle_isa(batch), "scalar") == 0 && bristle_isa(NULL) == NULL);
  EXPECT((bristle_threads(batch) == 1 || bristle_threads(batch) == 2) && bristle_threads(NULL) == 0);
  bristle_destroy(batch);
  material.bristle_damping = 3.0;
  material.stribeck_velocity = 1e-3;
  EXPECT(bristle_material_damping(&material, speeds, dampings, 2) == BRISTLE_OK);
  EXPECT(dampings[0] == 3.0 && fabs(dampings[1] - 3.0 * exp(-1.0)) < 1e-12);
  return 0;
}

int c_program_watches_a_deadline(void) {
  bristle_monitor* monitor = NULL;
  bristle_monitor_report report;
  int i;
  EXPECT(bristle_monitor_create(0.0, 0.0, &monitor) == BRISTLE_REFUSED);
  EXPECT(bristle_monitor_create(1e-3, 1e-3, &monitor) == BRISTLE_OK);
  for (i = 0; i < 98; ++i) bristle_monitor_record(monitor, 1e-4, -1.0);
  bristle_monitor_record(monitor, 2e-3, 1e-4);
  bristle_monitor_record(monitor, 3e-3, 2e-3);
  bristle_monitor_record_skipped(monitor, 5);
  bristle_monitor_pause(monitor);
  bristle_monitor_refresh_events(monitor);
  bristle_init_monitor_report(&report, sizeof report);
  EXPECT(bristle_monitor_find_report(monitor, &report) == BRISTLE_OK);
  EXPECT(report.count == 100 && report.misses == 2 && report.misses_ours == 1 && report.deadline == 1e-3);
  EXPECT(report.skipped == 5 && report.max == 3e-3);
  bristle_monitor_reset(monitor);
  EXPECT(bristle_monitor_find_report(monitor, &report) == BRISTLE_OK);
  EXPECT(report.count == 0 && report.max == 0.0);
  bristle_monitor_destroy(monitor);
  EXPECT(bristle_wall_now() > 0.0 && bristle_cpu_now() > 0.0);
  return 0;
}
