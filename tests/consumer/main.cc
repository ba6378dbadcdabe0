#include "core/version.h"
#include "factor/material.h"

#include <cstdio>

int main() {
  const nacre::factor::Material material;
  std::printf("nacre %s, %d points\n",
              nacre::Version().c_str(),
              static_cast<int>(material.PointCount()));
  return 0;
}
