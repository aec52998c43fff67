// Histogram of the shown picture: three channels of display values, and the shares that are clipped.

const bins = 128;

const tenth = 89; // display value of a tenth of white

// Counts per channel, and the shares of the object that are clipped or lighter than a tenth of white; `pixels` is RGBA bytes. Pixels of the background, within what
// JPEG changes, are left out.
export function histogramOf(pixels, background) {
  const counts = [0, 1, 2].map(() => new Float64Array(bins)),
    around = background.map((c) => 255 * c);
  let low = 0,
    high = 0,
    light = 0,
    n = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    if (around.every((c, k) => Math.abs(pixels[i + k] - c) <= 3)) continue;
    ++n;
    for (let c = 0; c < 3; ++c) ++counts[c][pixels[i + c] >> 1];
    const most = Math.max(pixels[i], pixels[i + 1], pixels[i + 2]);
    if (most >= 254) ++high;
    if (most >= tenth) ++light;
    if (most <= 1) ++low;
  }
  const share = (count) => count / Math.max(1, n);
  return { counts, n, low: share(low), high: share(high), light: share(light) };
}

// The pixels of a picture, at most 256 wide.
export function smallPixels(bitmap) {
  const k = Math.min(1, 256 / bitmap.width);
  const canvas = new OffscreenCanvas(
    Math.max(1, Math.round(bitmap.width * k)),
    Math.max(1, Math.round(bitmap.height * k)),
  );
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.imageSmoothingEnabled = false; // means would hide clipping
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  return context.getImageData(0, 0, canvas.width, canvas.height).data;
}

export function drawHistogram(canvas, { counts }, logarithmic, colors) {
  const width = (canvas.width = canvas.clientWidth * devicePixelRatio),
    height = (canvas.height = canvas.clientHeight * devicePixelRatio);
  const context = canvas.getContext("2d"),
    value = (x) => (logarithmic ? Math.log1p(x) : x);
  // The end bins hold clipped pixels; they do not set the scale.
  const most = Math.max(1e-9, ...counts.flatMap((channel) => [...channel.subarray(1, bins - 1)].map(value)));
  context.globalAlpha = 0.65;
  counts.forEach((channel, c) => {
    context.fillStyle = colors[c];
    context.beginPath();
    context.moveTo(0, height);
    channel.forEach((x, i) => {
      const y = height * (1 - Math.min(1, value(x) / most));
      context.lineTo((i / bins) * width, y);
      context.lineTo(((i + 1) / bins) * width, y);
    });
    context.lineTo(width, height);
    context.fill();
  });
}
