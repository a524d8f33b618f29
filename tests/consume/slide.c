/* A user's program in C99: pulls a pressed patch over 200 um and prints the force. */
#include <bristle/bristle.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  bristle_coefficients coefficients;
  bristle_material material;
  bristle_patch_options options;
  bristle_batch* batch = NULL;
  bristle_id tip = 0;
  bristle_motion in;
  bristle_response out;
  double peak = 0.0;
  int tick;

  memset(&in, 0, sizeof in);
  memset(&out, 0, sizeof out);
  bristle_init_coefficients(&coefficients, sizeof coefficients);
  bristle_init_material(&material, sizeof material);
  bristle_init_patch_options(&options, sizeof options);
  coefficients.kinetic = 0.40;
  coefficients.peak = 0.46;
  coefficients.rule = BRISTLE_RULE_KEEP;
  coefficients.residual_share = coefficients.shared_renewal = 0.0; /* Coefficients::paper() in C++ */
  options.max_normal_load = 4.0;
  options.axes = 1;
  if (bristle_check_build(BRISTLE_VERSION_NUMBER, BRISTLE_BUILD_OPTIONS) != BRISTLE_OK ||
      bristle_material_from_coefficients(&coefficients, &material) != BRISTLE_OK ||
      bristle_create(NULL, &batch) != BRISTLE_OK ||
      bristle_add(batch, &material, &options, &tip) != BRISTLE_OK || bristle_warm_up(batch) != BRISTLE_OK) {
    printf("%s\n", bristle_last_error());
    return 1;
  }
  for (tick = 1; tick <= 100; ++tick) {
    in.id = tip;
    in.displacement[0] = 2e-6;
    in.normal_load = 1.0;
    bristle_step(batch, 1e-3, &in, sizeof in, &out, sizeof out, 1, NULL);
    if (-out.end[0] > peak) peak = -out.end[0];
  }
  printf("bristle %s: peak %.9f N, in the end %.9f N, state %016llx\n", bristle_version(), peak, -out.end[0],
         (unsigned long long)bristle_state_hash(batch, 0));
  bristle_destroy(batch);
  return 0;
}
