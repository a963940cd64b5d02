// Browsers start no worker on a page that was opened from a file: there the search runs in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.body.appendChild(Object.assign(document.createElement("iframe"), { hidden: true }));
      this.window = frame.contentWindow;
      window.addEventListener("message", event => {
        if (event.source !== this.window) return;
        const message = new MessageEvent("message", { data: event.data });
        this.dispatchEvent(message);
        if (this.onmessage) this.onmessage(message);
      });
      const script = "postMessage = parent.postMessage.bind(parent); importScripts = () => {}";
      this.window.document.open();
      this.window.document.write(`<script>${script}</${""}script><script src="${url}"></${""}script>`);
      this.window.document.close();
    }
    postMessage(data) { this.window.postMessage(data, "*"); }
    terminate() {}
  };
}
