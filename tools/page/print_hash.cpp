// Prints the state hash of the page's fixed scene, as this build and machine compute it.
#include <cstdio>

#include "fixed_scene.hpp"

int main() { std::puts(page::fixed_scene_hash().c_str()); }
