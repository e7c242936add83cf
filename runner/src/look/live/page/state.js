// What the page knows, besides what its controls hold.

/// An element of the page.
export const at = (id) => document.getElementById(id);
export const canvas = at("canvas");

/// Everything there is to know, besides what the controls hold.
export const state = {
  drawing: null,
  hello: null,
  sources: [],
  camera: { x: 0, y: 0, zoom: 1 },
  playing: true,
  body: null,
  difference: null,
  following: false,
  step: 0,
  frames: 0,
  legend: "",
  legends: [],
  due: false,
  asked: "",
  failure: null,
  over: false,
};
