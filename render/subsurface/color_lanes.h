#pragma once

#include "render/vec.h"

#include <array>

namespace nacre::render {

/// R, G, B and one unused lane, so that a colour is one register.
struct alignas(16) ColorLanes {
  std::array<float, 4> v{};

  ColorLanes& operator+=(const ColorLanes& b) {
    for (std::size_t c = 0; c < 4; ++c) {
      v[c] += b.v[c];
    }
    return *this;
  }
  friend ColorLanes operator+(ColorLanes a, const ColorLanes& b) { return a += b; }
  friend ColorLanes operator*(const ColorLanes& a, const ColorLanes& b) {
    ColorLanes product;
    for (std::size_t c = 0; c < 4; ++c) {
      product.v[c] = a.v[c] * b.v[c];
    }
    return product;
  }
  friend ColorLanes operator*(const ColorLanes& a, float s) {
    ColorLanes product;
    for (std::size_t c = 0; c < 4; ++c) {
      product.v[c] = a.v[c] * s;
    }
    return product;
  }
};

inline ColorLanes ToLanes(Color c) {
  return {{c.x, c.y, c.z, 0}};
}

inline ColorLanes Mix(const ColorLanes& a, const ColorLanes& b, float fraction) {
  ColorLanes mixed;
  for (std::size_t c = 0; c < 4; ++c) {
    mixed.v[c] = a.v[c] + fraction * (b.v[c] - a.v[c]);
  }
  return mixed;
}

}  // namespace nacre::render
