#include "render/named_media.h"

#include <array>
#include <cctype>

namespace nacre::render {
namespace {

// Red absorption of chicken is often quoted ten times too low; these values reproduce
// the reflectances of the paper's own table.
constexpr std::array<NamedMedium, 47> kMedia = {{
    {"apple", {2.29F, 2.39F, 1.97F}, {0.003F, 0.0034F, 0.046F}, {}, 1.3F},
    {"chicken1", {0.15F, 0.21F, 0.38F}, {0.015F, 0.077F, 0.19F}, {}, 1.3F},
    {"chicken2", {0.19F, 0.25F, 0.32F}, {0.018F, 0.088F, 0.2F}, {}, 1.3F},
    {"cream", {7.38F, 5.47F, 3.15F}, {0.0002F, 0.0028F, 0.0163F}, {}, 1.3F},
    {"ketchup", {0.18F, 0.07F, 0.03F}, {0.061F, 0.97F, 1.45F}, {}, 1.3F},
    {"marble", {2.19F, 2.62F, 3.00F}, {0.0021F, 0.0041F, 0.0071F}, {}, 1.5F},
    {"potato", {0.68F, 0.70F, 0.55F}, {0.0024F, 0.009F, 0.12F}, {}, 1.3F},
    {"skimmilk", {0.70F, 1.22F, 1.90F}, {0.0014F, 0.0025F, 0.0142F}, {}, 1.3F},
    {"skin1", {0.74F, 0.88F, 1.01F}, {0.032F, 0.17F, 0.48F}, {}, 1.3F},
    {"skin2", {1.09F, 1.59F, 1.79F}, {0.013F, 0.07F, 0.145F}, {}, 1.3F},
    {"spectralon", {11.6F, 20.4F, 14.9F}, {0, 0, 0}, {}, 1.3F},
    {"wholemilk", {2.55F, 3.21F, 3.77F}, {0.0011F, 0.0024F, 0.014F}, {}, 1.3F},
    // [Narasimhan06], diluted media at their usual strength; colas, wine and juice
    // scatter next to nothing.
    {"lowfat milk",
     {13.1157F, 15.4445F, 17.9572F},
     {0.00287F, 0.00575F, 0.01150F},
     {0.932F, 0.902F, 0.859F},
     1.33F},
    {"reduced milk",
     {13.7335F, 15.6003F, 17.8007F},
     {0.00256F, 0.00511F, 0.01278F},
     {0.819F, 0.797F, 0.746F},
     1.33F},
    {"regular milk",
     {18.2052F, 20.3826F, 22.3698F},
     {0.00153F, 0.00460F, 0.01993F},
     {0.750F, 0.714F, 0.681F},
     1.33F},
    {"espresso",
     {7.78262F, 8.13050F, 8.53875F},
     {4.79838F, 6.57512F, 8.84925F},
     {0.907F, 0.896F, 0.880F},
     1.33F},
    {"mint mocha coffee",
     {3.51133F, 4.14383F, 5.59667F},
     {3.77200F, 5.82283F, 7.82000F},
     {0.910F, 0.907F, 0.914F},
     1.33F},
    {"lowfat soy milk",
     {2.03838F, 2.32875F, 3.90281F},
     {0.00144F, 0.00719F, 0.03594F},
     {0.850F, 0.853F, 0.842F},
     1.33F},
    {"regular soy milk",
     {4.66325F, 5.20183F, 8.74575F},
     {0.00192F, 0.00958F, 0.06517F},
     {0.873F, 0.858F, 0.832F},
     1.33F},
    {"lowfat chocolate milk",
     {9.83710F, 11.4954F, 13.1629F},
     {0.01150F, 0.03680F, 0.15640F},
     {0.934F, 0.927F, 0.916F},
     1.33F},
    {"regular chocolate milk",
     {10.5685F, 13.1416F, 15.2202F},
     {0.01006F, 0.04313F, 0.14375F},
     {0.862F, 0.838F, 0.806F},
     1.33F},
    {"coke",
     {0.00254F, 0.00299F, 0},
     {0.10014F, 0.16503F, 0.24680F},
     {0.965F, 0.972F, 0},
     1.33F},
    {"pepsi",
     {0.00083F, 0.00203F, 0},
     {0.09164F, 0.14158F, 0.20729F},
     {0.926F, 0.979F, 0},
     1.33F},
    {"sprite",
     {0.00011F, 0.00014F, 0.00014F},
     {0.00189F, 0.00183F, 0.00200F},
     {0.943F, 0.953F, 0.952F},
     1.33F},
    {"gatorade",
     {0.03668F, 0.04488F, 0.05742F},
     {0.02479F, 0.01929F, 0.00888F},
     {0.933F, 0.933F, 0.935F},
     1.33F},
    {"chardonnay",
     {0.00021F, 0.00033F, 0.00048F},
     {0.01078F, 0.01186F, 0.02400F},
     {0.914F, 0.958F, 0.975F},
     1.33F},
    {"white zinfandel",
     {0.00022F, 0.00033F, 0.00046F},
     {0.01207F, 0.01618F, 0.01984F},
     {0.919F, 0.943F, 0.972F},
     1.33F},
    {"merlot", {0.00081F, 0, 0}, {0.11632F, 0.25191F, 0.29434F}, {0.974F, 0, 0}, 1.33F},
    {"budweiser beer",
     {0.00029F, 0.00055F, 0.00059F},
     {0.01149F, 0.02491F, 0.05779F},
     {0.917F, 0.956F, 0.982F},
     1.33F},
    {"coors light beer",
     {0.00062F, 0.00127F, 0},
     {0.00616F, 0.01398F, 0.03498F},
     {0.918F, 0.966F, 0},
     1.33F},
    {"clorox",
     {0.02731F, 0.03302F, 0.03695F},
     {0.00335F, 0.01489F, 0.02630F},
     {0.912F, 0.905F, 0.892F},
     1.33F},
    {"apple juice",
     {0.00257F, 0.00311F, 0.00413F},
     {0.01296F, 0.02374F, 0.05218F},
     {0.947F, 0.949F, 0.945F},
     1.33F},
    {"cranberry juice",
     {0.00196F, 0.00238F, 0.00301F},
     {0.03944F, 0.09422F, 0.12426F},
     {0.947F, 0.951F, 0.974F},
     1.33F},
    {"grape juice",
     {0.00138F, 0, 0},
     {0.10404F, 0.23958F, 0.29325F},
     {0.961F, 0, 0},
     1.33F},
    {"ruby grapefruit juice",
     {0.15496F, 0.15391F, 0.15995F},
     {0.08587F, 0.18314F, 0.25262F},
     {0.929F, 0.929F, 0.931F},
     1.33F},
    {"white grapefruit juice",
     {0.50499F, 0.52742F, 0.75282F},
     {0.01380F, 0.01883F, 0.05678F},
     {0.548F, 0.545F, 0.565F},
     1.33F},
    {"shampoo",
     {0.00797F, 0.00874F, 0.01127F},
     {0.01411F, 0.04569F, 0.06172F},
     {0.910F, 0.905F, 0.920F},
     1.33F},
    {"strawberry shampoo",
     {0.00215F, 0.00245F, 0.00253F},
     {0.01449F, 0.05796F, 0.07582F},
     {0.927F, 0.935F, 0.994F},
     1.33F},
    {"head & shoulders shampoo",
     {0.26747F, 0.27696F, 0.29574F},
     {0.08462F, 0.15688F, 0.20365F},
     {0.911F, 0.896F, 0.884F},
     1.33F},
    {"lemon tea powder",
     {0.74489F, 0.83823F, 1.00158F},
     {2.42881F, 4.57573F, 7.21270F},
     {0.946F, 0.946F, 0.949F},
     1.33F},
    {"orange juice powder",
     {0.00193F, 0.00213F, 0.00226F},
     {0.00145F, 0.00344F, 0.00786F},
     {0.919F, 0.918F, 0.922F},
     1.33F},
    {"pink lemonade powder",
     {0.00123F, 0.00133F, 0.00131F},
     {0.00116F, 0.00237F, 0.00320F},
     {0.902F, 0.902F, 0.904F},
     1.33F},
    {"cappuccino powder",
     {12.2094F, 16.4659F, 29.2727F},
     {35.8441F, 49.5470F, 61.0844F},
     {0.849F, 0.843F, 0.926F},
     1.33F},
    {"salt powder",
     {0.13805F, 0.15677F, 0.17865F},
     {0.28415F, 0.32570F, 0.34148F},
     {0.802F, 0.793F, 0.821F},
     1.33F},
    {"sugar powder",
     {0.00282F, 0.00315F, 0.00393F},
     {0.01264F, 0.03105F, 0.05012F},
     {0.921F, 0.919F, 0.931F},
     1.33F},
    {"suisse mocha powder",
     {30.0848F, 33.4452F, 38.7191F},
     {17.5020F, 27.0044F, 35.4334F},
     {0.907F, 0.894F, 0.888F},
     1.33F},
    {"pacific ocean surface water",
     {0.00180F, 0.00183F, 0.00228F},
     {0.03184F, 0.03132F, 0.03015F},
     {0.902F, 0.825F, 0.914F},
     1.33F},
}};

// In lower case, without blanks.
std::string Plain(const std::string& name) {
  std::string plain;
  for (const char c : name) {
    if (c != ' ' && c != '_') {
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return plain;
}

}  // namespace

std::optional<NamedMedium> FindNamedMedium(const std::string& name) {
  const std::string plain = Plain(name);
  for (const NamedMedium& medium : kMedia) {
    if (plain == Plain(medium.name)) {
      return medium;
    }
  }
  return std::nullopt;
}

std::vector<std::string> NamedMediaNames() {
  std::vector<std::string> names;
  names.reserve(std::size(kMedia));
  for (const NamedMedium& medium : kMedia) {
    names.emplace_back(medium.name);
  }
  return names;
}

}  // namespace nacre::render
