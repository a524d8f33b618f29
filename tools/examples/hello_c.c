#include <stdio.h>

#include <bristle/bristle.h>

int main(void) {
  bristle_coefficients wood;
  bristle_material material;
  bristle_patch_options options;
  bristle_init_coefficients(&wood, sizeof wood); /* defaults: kinetic 0.40, peak 0.46 */
  bristle_init_material(&material, sizeof material);
  bristle_init_patch_options(&options, sizeof options);
  wood.presliding_length = 20e-6; /* m */
  options.max_normal_load = 2.0;  /* N */

  bristle_batch* batch = NULL;
  bristle_id patch = 0;
  if (bristle_material_from_coefficients(&wood, &material) != BRISTLE_OK ||
      bristle_create(NULL, &batch) != BRISTLE_OK ||
      bristle_add(batch, &material, &options, &patch) != BRISTLE_OK) {
    fprintf(stderr, "%s\n", bristle_last_error());
    return 1;
  }
  for (int step = 1; step <= 100; ++step) {
    /* 2 um towards +x under 1 N; the force on the moving body points towards -x. */
    const bristle_motion motion = {.id = patch, .displacement = {2e-6, 0.0}, .normal_load = 1.0};
    bristle_response response;
    bristle_step(batch, 1e-3, &motion, sizeof motion, &response, sizeof response, 1, NULL);
    if (step % 20 == 0) printf("%3d um  %.3f N\n", 2 * step, response.end[0]);
  }
  bristle_destroy(batch);
  return 0;
}
