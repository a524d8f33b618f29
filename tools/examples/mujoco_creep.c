/* Prints the speed at which the last body of a model sinks. Usage: bristle_mujoco_creep MODEL.xml [PLUGIN.so]
 */
#include <stdio.h>

#include <mujoco/mujoco.h>

int main(int count, char** given) {
  char error[500] = "usage: bristle_mujoco_creep MODEL.xml [PLUGIN.so]";
  if (count > 2) mj_loadPluginLibrary(given[2]);
  mjModel* model = count > 1 ? mj_loadXML(given[1], NULL, error, sizeof error) : NULL;
  if (model == NULL) return fprintf(stderr, "%s\n", error), 1;
  mjData* data = mj_makeData(model);
  mj_resetDataKeyframe(model, data, 0);
  const mjtNum* height = data->xpos + 3 * (model->nbody - 1) + 2;
  while (data->time < 0.5) mj_step(model, data);
  const mjtNum start = *height;
  while (data->time < 2.5) mj_step(model, data);
  printf("%.6f um/s\n", (start - *height) / 2.0 * 1e6);
  mj_deleteData(data);
  mj_deleteModel(model);
}
