// Scale of the previews: the largest of a few steps at which a picture takes about 50 ms from request to canvas.

const targetMs = 50;
const steps = [1, 0.75, 0.5, 0.375, 0.25, 0.2];

export class Pace {
  constructor() {
    this.scale = 0.5;
    this.wanted = null; // smoothed
  }

  // Learns from a picture of this scale that took so long. Time is taken to grow with the number of pixels.
  measured(ms, scale) {
    const wanted = scale * Math.sqrt(targetMs / Math.max(ms, 1));
    this.wanted = this.wanted === null ? wanted : this.wanted + 0.4 * (wanted - this.wanted);
    const fits = (step) => step <= this.wanted / (step > this.scale ? 1.15 : 1);
    this.scale = steps.find(fits) ?? steps[steps.length - 1];
  }
}
