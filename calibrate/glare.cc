#include "calibrate/glare.h"

#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>

namespace nacre::calibrate {

struct GlareFilter::Spectrum {
  int width = 0;
  int height = 0;
  double fraction = 0;
  cv::Mat kernel;   // of K, packed as OpenCV's dft does; it is real and even
  cv::Mat inverse;  // 1 / (1 − g + K)

  std::vector<float> Filter(const std::vector<float>& picture,
                            const cv::Mat& by) const {
    cv::Mat padded = cv::Mat::zeros(by.size(), CV_32FC1);
    cv::Mat(height, width, CV_32FC1, const_cast<float*>(picture.data()))
        .copyTo(padded(cv::Rect(0, 0, width, height)));
    cv::dft(padded, padded, 0, height);
    cv::mulSpectrums(padded, by, padded, 0);
    cv::dft(padded, padded, cv::DFT_INVERSE | cv::DFT_SCALE, height);
    std::vector<float> result;
    result.reserve(picture.size());
    for (int y = 0; y < height; ++y) {
      result.insert(result.end(), padded.ptr<float>(y), padded.ptr<float>(y) + width);
    }
    return result;
  }
};

GlareFilter::GlareFilter(const Glare& glare, int width_px, int height_px) {
  if (glare.empty()) {
    return;
  }
  spectrum_ = std::make_unique<Spectrum>();
  Spectrum& s = *spectrum_;
  s.width = width_px;
  s.height = height_px;
  // What is scattered farther than half a picture is spread too thin to matter.
  const int reach = std::max(width_px, height_px) / 2;
  const cv::Size size(cv::getOptimalDFTSize(width_px + reach),
                      cv::getOptimalDFTSize(height_px + reach));
  cv::Mat kernel = cv::Mat::zeros(size, CV_32FC1);
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double r = std::hypot(x, y);
      const double density = r <= reach ? glare.DensityAt(r) : 0;
      kernel.at<float>((y + size.height) % size.height, (x + size.width) % size.width) =
          static_cast<float>(density);
      s.fraction += density;
    }
  }
  cv::Mat spectrum;
  cv::dft(kernel, spectrum, cv::DFT_COMPLEX_OUTPUT);
  // Packed spectra hold real and imaginary parts beside each other. That of an even
  // kernel is real, and so is its inverse: go there and back.
  cv::Mat inverse(size, CV_32FC2);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double k = static_cast<double>(spectrum.at<cv::Vec2f>(y, x)[0]);
      inverse.at<cv::Vec2f>(y, x) =
          cv::Vec2f(static_cast<float>(1 / (1 - s.fraction + k)), 0.0F);
    }
  }
  cv::Mat inverse_kernel;
  cv::dft(
      inverse, inverse_kernel, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  cv::dft(kernel, s.kernel);
  cv::dft(inverse_kernel, s.inverse);
}

GlareFilter::~GlareFilter() = default;
GlareFilter::GlareFilter(GlareFilter&&) noexcept = default;
GlareFilter& GlareFilter::operator=(GlareFilter&&) noexcept = default;

void GlareFilter::Remove(std::vector<float>& rates) const {
  if (spectrum_) {
    rates = spectrum_->Filter(rates, spectrum_->inverse);
  }
}

std::vector<float> GlareFilter::Scattered(const std::vector<float>& rates) const {
  return spectrum_ ? spectrum_->Filter(rates, spectrum_->kernel)
                   : std::vector<float>(rates.size(), 0.0F);
}

void RemoveGlare(const Glare& glare,
                 int width_px,
                 int height_px,
                 std::vector<float>& rates) {
  GlareFilter(glare, width_px, height_px).Remove(rates);
}

}  // namespace nacre::calibrate
