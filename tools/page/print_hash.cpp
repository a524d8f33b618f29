// Prints the state hash of the page's fixed scene, for comparison with the one that the browser computes.
#include <cstdio>

#include "fixed_scene.hpp"

int main() { std::puts(page::fixed_scene_hash().c_str()); }
