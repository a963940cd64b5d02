// Browsers start no worker on a page that was opened from a file: there the search runs in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.body.appendChild(Object.assign(document.createElement("iframe"), { hidden: true }));
      const inside = frame.contentWindow, script = { src: url };
      inside.document.open();
      inside.document.close();
      inside.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }));
      this.inside = new Promise(done => {
        script.onload = () => done(inside);
        inside.document.documentElement.append(Object.assign(inside.document.createElement("script"), script));
      });
    }
    postMessage(data) {
      this.inside.then(inside => inside.dispatchEvent(new MessageEvent("message", { data })));
    }
    terminate() {}
  };
}
