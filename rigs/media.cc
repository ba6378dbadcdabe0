#include "rigs/media.h"

#include <algorithm>

namespace nacre::rigs {
namespace {

constexpr std::string_view kJensen = "Jensen01";
constexpr std::string_view kNarasimhan = "Narasimhan06";

constexpr std::array kMedia = {
    NamedMedium{"apple", {2.29, 2.39, 1.97}, {0.0030, 0.0034, 0.046}, 1.3, kJensen},
    NamedMedium{"chicken1", {0.15, 0.21, 0.38}, {0.015, 0.077, 0.19}, 1.3, kJensen},
    NamedMedium{"chicken2", {0.19, 0.25, 0.32}, {0.018, 0.088, 0.20}, 1.3, kJensen},
    NamedMedium{"cream", {7.38, 5.47, 3.15}, {0.0002, 0.0028, 0.0163}, 1.3, kJensen},
    NamedMedium{"ketchup", {0.18, 0.07, 0.03}, {0.061, 0.97, 1.45}, 1.3, kJensen},
    NamedMedium{"marble", {2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5, kJensen},
    NamedMedium{"potato", {0.68, 0.70, 0.55}, {0.0024, 0.0090, 0.12}, 1.3, kJensen},
    NamedMedium{"skimmilk", {0.70, 1.22, 1.90}, {0.0014, 0.0025, 0.0142}, 1.3, kJensen},
    NamedMedium{"skin1", {0.74, 0.88, 1.01}, {0.032, 0.17, 0.48}, 1.3, kJensen},
    NamedMedium{"skin2", {1.09, 1.59, 1.79}, {0.013, 0.070, 0.145}, 1.3, kJensen},
    NamedMedium{"spectralon", {11.6, 20.4, 14.9}, {0, 0, 0}, 1.3, kJensen},
    NamedMedium{"wholemilk", {2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}, 1.3, kJensen},
    NamedMedium{"lowfat-milk",
                {0.89187, 1.5136, 2.532},
                {0.002875, 0.00575, 0.0115},
                1.33,
                kNarasimhan},
    NamedMedium{"reduced-milk",
                {2.4858, 3.1669, 4.5214},
                {0.0025556, 0.0051111, 0.012778},
                1.33,
                kNarasimhan},
    NamedMedium{"regular-milk",
                {4.5513, 5.8294, 7.136},
                {0.0015333, 0.0046, 0.019933},
                1.33,
                kNarasimhan},
    NamedMedium{"lowfat-soy-milk",
                {0.30576, 0.34233, 0.61664},
                {0.0014375, 0.0071875, 0.035937},
                1.33,
                kNarasimhan},
    NamedMedium{"regular-soy-milk",
                {0.59223, 0.73866, 1.4693},
                {0.0019167, 0.0095833, 0.065167},
                1.33,
                kNarasimhan},
    NamedMedium{"lowfat-chocolate-milk",
                {0.64925, 0.83916, 1.1057},
                {0.0115, 0.0368, 0.1564},
                1.33,
                kNarasimhan},
    NamedMedium{"regular-chocolate-milk",
                {1.4585, 2.1289, 2.9527},
                {0.010063, 0.043125, 0.14375},
                1.33,
                kNarasimhan},
    NamedMedium{"espresso",
                {0.72378, 0.84557, 1.0247},
                {4.7984, 6.5751, 8.8493},
                1.33,
                kNarasimhan},
    NamedMedium{"white-grapefruit-juice",
                {0.22826, 0.23998, 0.32748},
                {0.0138, 0.018831, 0.056781},
                1.33,
                kNarasimhan},
};

}  // namespace

std::span<const NamedMedium> NamedMedia() {
  return kMedia;
}

const NamedMedium* FindNamedMedium(std::string_view name) {
  const auto at = std::find_if(kMedia.begin(), kMedia.end(), [&](const NamedMedium& m) {
    return m.name == name;
  });
  return at == kMedia.end() ? nullptr : &*at;
}

std::string NamedMediaList() {
  std::string list;
  for (const NamedMedium& medium : kMedia) {
    list += (list.empty() ? "" : ", ") + std::string(medium.name);
  }
  return list;
}

}  // namespace nacre::rigs
