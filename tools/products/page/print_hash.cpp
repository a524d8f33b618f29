// Prints the state hash of the page's fixed scene in a native build; the browser's must equal it.
#include <cstdio>

#include "fixed_scene.hpp"

int main() { std::puts(page::fixed_scene_hash().c_str()); }
